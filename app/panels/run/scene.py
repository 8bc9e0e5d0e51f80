"""The choice of robot and scene: catalog, a URDF by path, an upload, and the report of the import."""

from __future__ import annotations

from dataclasses import replace

import viser

from app.adapter.private import unless_removed
from app.html.palette import BAD, DAMPING, GOOD, LEVELS, css
from app.html.text import badge, block, esc
from app.link.choice import SceneChoice
from app.link.messages import Ready
from app.link.threads import on_thread
from app.panels.widgets.command import on_click
from app.tab.context import PageContext
from lessons.experiments.verdict import verdict
from lessons.own.files import Folder, is_file, is_lesson
from lessons.scenes.names import ALL_SCENES
from lessons.scenes.run_spec import RunSpec
from robots import CATALOG, InputError

_KINDS = {"repaired": LEVELS[0], "filled": LEVELS[1], "fixed": LEVELS[3], "refused": BAD, "note": DAMPING}
_UPLOADED = ".urdf,.xml,.zip,application/xml,text/xml,application/zip"
_READABLE = b"PK", b"\xff\xfe", b"\xfe\xff"  # the first bytes of a zip and of UTF-16
MAX_UPLOAD = 10_000_000  # bytes: the largest file that the importer reads


class RobotPanel:
    """The panel of robot and scene. A choice becomes a `SceneChoice`; the simulation answers with the new
    scene or with the reason of a refusal."""

    def __init__(self, page: PageContext) -> None:
        gui, ready, scenes, own_files = page.gui, page.ready, ALL_SCENES, page.visitor.own_files
        robot = ready.robot
        self._choose = page.choose
        gui.add_html(
            block(
                f"<b>{esc(robot.name)}</b>: {robot.n} joints, hand at <b>{esc(robot.tip)}</b>, "
                f"scene <b>{esc(ready.choice.run.scene)}</b>"
            )
        )
        self._ask_tip(gui, ready)
        self._add_verdict(gui, ready)
        for sentence in ready.left_out:
            words = (
                f"{badge('LEFT OUT', LEVELS[1])} One of your tasks does not fit this robot. {esc(sentence)}"
            )
            gui.add_html(block(words))
        self._answer: viser.GuiHtmlHandle | None = None
        self._waits = False
        with gui.add_folder("Scene"):
            names, now = tuple(name for name in scenes if name != "hold"), ready.choice.run.scene
            scene = gui.add_dropdown("Scene", names, initial_value=now if now in names else names[0])
            described = gui.add_html(block(esc(scenes[str(scene.value)]), lines=2))
            of_scene = _answer(gui)
            load_scene = gui.add_button("Load scene")
        with gui.add_folder("Robot of the catalog"):
            catalog = gui.add_dropdown(
                "Robot", tuple(CATALOG), initial_value=robot.name if robot.name in CATALOG else None
            )
            about = gui.add_html(block(esc(CATALOG[str(catalog.value)].title), lines=2))
            of_robot = _answer(gui)
            load_robot = gui.add_button("Load robot")
        with gui.add_folder("Your own URDF"):
            tip = gui.add_text(
                "Hand frame",
                "",
                hint="Name of a link; if empty, the end of the longest chain. NAME@x,y,z,roll,pitch,yaw "
                "puts a tool on it, m and rad",
            )
            hold = gui.add_text(
                "Held joints",
                "",
                hint="Names or regular expressions, separated by spaces; joint=0.5 at 0.5 rad",
            )
            of_urdf = _answer(gui)

            def asked(urdf: str | None = None) -> RunSpec:
                held = tuple(hold.value.split())
                return RunSpec("hold", urdf, tip.value.strip() or None, hold=held)

            if own_files is not None:
                path = gui.add_text("File", "", hint="Path of a URDF on the machine that runs this page")
                load_path = gui.add_button("Load file")

                on_click(load_path, lambda: self._ask_file(of_urdf, own_files, asked(path.value.strip())))

            upload = gui.add_upload_button("Upload a URDF", mime_type=_UPLOADED)
            gui.add_html(
                block(
                    "Or drop a file here. The robot's folder, or a zip of it, brings its meshes along; "
                    "without them, capsules are drawn."
                )
            )
        if own_files is not None:
            self._add_file(gui, ready.choice, own_files)
        self._report(gui, ready)

        @scene.on_update
        async def _(_: object) -> None:
            described.content = block(esc(scenes[str(scene.value)]), lines=2)

        @catalog.on_update
        async def _(_: object) -> None:
            about.content = block(esc(CATALOG[str(catalog.value)].title), lines=2)

        on_click(load_scene, lambda: self._ask(of_scene, RunSpec(str(scene.value))))

        @load_robot.on_click
        async def _(_: object) -> None:
            name = str(catalog.value)
            run = RunSpec(f"{name}-hold") if f"{name}-hold" in scenes else RunSpec("hold", name)
            self._ask(of_robot, run)

        @upload.on_upload
        async def _(_: object) -> None:
            self._uploaded(of_urdf, upload.value.content, asked())

    def _ask_tip(self, gui: viser.GuiApi, ready: Ready) -> None:
        """Offers the frames that are as likely as the hand of a robot from a file."""
        robot, current = ready.robot, ready.choice
        likely = (robot.tip, *robot.report.tips)
        if len(likely) < 2 or current.exercise is not None or current.run.scene != "hold":
            return
        frame = gui.add_dropdown("Hand", likely, hint="Frames that may be the hand; its name did not decide")
        answer = _answer(gui)

        @frame.on_update
        async def _(_: object) -> None:
            self._wait(answer)
            self._choose(replace(current, run=replace(current.run, tip=str(frame.value))))

    def _add_verdict(self, gui: viser.GuiApi, ready: Ready) -> None:
        """Adds the number of findings and how a robot from a file follows a dragged target. The drag is
        computed in a process of its own; the card says so until it ends."""
        robot = ready.robot
        if ready.choice.run.scene != "hold" or robot.name in CATALOG:
            return
        count = len(robot.report.findings)
        found = f"<b>{count} finding{'' if count == 1 else 's'}</b> · "
        card = gui.add_html(block(f"{found}its target is being dragged …"))

        def drag_on_thread() -> None:
            text = verdict(robot)
            colour = GOOD if text.startswith("follows") else LEVELS[1]
            unless_removed(setattr, card, "content", block(f"{found}{esc(text)}", _edge(colour)))

        on_thread("drag", drag_on_thread)

    def _add_file(self, gui: viser.GuiApi, current: SceneChoice, own_files: Folder) -> None:
        with gui.add_folder("A file of your own"):
            gui.add_html(block(_FILES))
            path = gui.add_text("Your file", "", hint="Path on the machine that runs this page")
            answer = _answer(gui)
            load = gui.add_button("Open file")

        @load.on_click
        def _(_: object) -> None:
            """Opens the file on a thread, as the file is first loaded in a separate process, which takes a
            second."""
            name = path.value.strip()
            self._wait(answer)
            if not (is_file(name) or is_lesson(name)):
                self.refuse("First enter the path of a Python file (.py) or of a lesson (.md).")
                return
            try:
                choice = current.with_file(own_files.admits(name))
                choice.resolved().scene()
            except InputError as error:
                self.refuse(str(error))
            else:
                self._choose(choice)

    def _ask_file(self, answer: viser.GuiHtmlHandle, own_files: Folder, run: RunSpec) -> None:
        self._wait(answer)
        if not run.urdf:
            self.refuse("First enter the path of a URDF file.")
            return
        try:
            run = replace(run, urdf=own_files.admits(run.urdf))
        except InputError as error:
            self.refuse(str(error))
        else:
            self._choose(SceneChoice(run, within=own_files.path))

    def _ask(self, answer: viser.GuiHtmlHandle, run: RunSpec, urdf_text: str | bytes | None = None) -> None:
        self._wait(answer)
        self._choose(SceneChoice(run, urdf_text))

    def _uploaded(self, answer: viser.GuiHtmlHandle, content: bytes, run: RunSpec) -> None:
        self._wait(answer)
        if len(content) > MAX_UPLOAD:
            self.refuse(f"The file has more than {MAX_UPLOAD // 1_000_000} MB; choose a smaller one.")
            return
        if b"\0" in content and not content.startswith(_READABLE):
            self.refuse("The file is not text: upload the URDF file itself, or a zip of the robot's folder.")
            return
        self._ask(answer, run, content)

    def _wait(self, answer: viser.GuiHtmlHandle) -> None:
        """Shows that a request is in progress. `answer` is the text above the control that was used; a text
        below the control could be outside the visible part."""
        if self._answer is not None:
            self._answer.visible = False
        self._answer, self._waits = answer, True
        answer.content = block("Loading …")
        answer.visible = True

    def refuse(self, sentence: str) -> bool:
        """Shows why a scene or robot was not loaded; the previous scene continues. Returns whether the
        request came from this panel."""
        waited, self._waits = self._waits, False
        if waited and self._answer is not None:
            self._answer.content = block(f"{badge('NOT LOADED', BAD)} {esc(sentence)}", _edge(BAD))
        return waited

    def _report(self, gui: viser.GuiApi, ready: Ready) -> None:
        report = ready.robot.report
        with gui.add_folder(f"Import report ({len(report.findings)})", expand_by_default=False):
            if not report.findings:
                gui.add_html(block(f"{badge('SOUND', GOOD)} Nothing had to be repaired."))
            for finding in report.findings[:60]:
                kind = badge(finding.kind, _KINDS[finding.kind])
                gui.add_html(block(f"{kind} <b>{esc(finding.where)}</b>: {esc(finding.text)}"))
            if len(report.findings) > 60:
                gui.add_html(block(f"… and {len(report.findings) - 60} more."))


def _edge(colour: tuple[int, int, int]) -> str:
    return f"border-left:3px solid {css(colour)}"


def _answer(gui: viser.GuiApi) -> viser.GuiHtmlHandle:
    return gui.add_html("", visible=False)


_FILES = (
    "The content of the file decides whether it is a controller, scene, lesson or task. The file "
    "must be in or below the folder in which himpc-lab was started (or --own-files DIR). The file is read on "
    "this machine and never uploaded. Only the page of the first address that himpc-lab printed has this "
    "form. <code>himpc-lab new</code> writes a template."
)
