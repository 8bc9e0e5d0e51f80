"""`himpc-lab` without a subcommand: serves the page."""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Annotated

import tyro

from app.commands.lists import HeldJoints, RobotFile, Tool
from robots import InputError


def serve(
    lesson: str | None = None,
    scene: str | None = None,
    urdf: RobotFile = None,
    tip: str | None = None,
    tool: Tool = None,
    hold: HeldJoints = (),
    controller: str | None = None,
    task: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="FILE.py")] = (),
    state: str | None = None,
    max_sessions: int = 4,
    classroom: bool = False,
    class_: Annotated[bool, tyro.conf.FlagCreatePairsOff, tyro.conf.arg(name="class")] = False,
    no_names: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    host: str = "127.0.0.1",
    port: int = 8080,
    no_browser: bool = False,
    trusted_origin: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="ORIGIN")
    ] = (),
    embed_in: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="ORIGIN")] = (),
    no_token: bool = False,
    token_file: Annotated[str | None, tyro.conf.arg(metavar="FILE")] = None,
    one_of_several: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    drain: float = 0.0,
    proxy_only: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    own_files: Annotated[str | None, tyro.conf.arg(metavar="DIR")] = None,
    no_own_files: Annotated[bool, tyro.conf.FlagCreatePairsOff] = False,
    key: str | None = None,
) -> int:
    """Open the page: a robot under HIMPC whose target you can drag.

    Args:
        lesson: lesson to start with, see himpc-lab lessons, or a Markdown file of your own.
        scene: scene to start with, or a Python file of your own; iiwa14-hold by default, hold with --urdf.
        controller: controller to start with, or a Python file of your own; its code is reloaded whenever
            you save the file.
        task: Python file with a task of your own, which can then be added to the stack.
        urdf: your own robot: a URDF or MuJoCo model (.xml), or a folder or zip with one.
        tip: end-effector frame of that robot.
        tool: place of a tool in that frame, m and rad; the tool's frame is then the end effector. A number
            with a minus in front: --tool=-0.1,0,0.
        hold: hold the joints of that robot with this name or regular expression where the file's home has
            them, or at 0; with PATTERN=VALUE at VALUE (rad or m).
        state: a state code, as the page shows it; the page gets its scene, robot, settings, seed, lesson and
            step.
        max_sessions: number of people who may use the page at once, each with a robot of their own.
        classroom: one robot for all pages; only a page with the printed token can control it.
        class_: open a page from which a teacher leads a class through a lesson, and a page on which phones
            vote; docs/instructors.md describes a lecture. With --classroom, all watch the teacher's robot.
        no_names: do not ask people in a class for their names.
        host: address to listen on; only this machine can reach the default address. The page asks for a
            token, which is part of the printed address.
        port: port to listen on.
        no_browser: do not open a browser.
        trusted_origin: address at which a reverse proxy serves the page, e.g. https://lab.example.org;
            docs/serving.md describes such a proxy with TLS.
        embed_in: origin of a page that may show the lab's page in a frame, e.g. https://course.example.org;
            no other page may do so.
        no_token: let everybody who can reach the page use it, including every user of this machine.
        token_file: file with a token of your own, for several servers behind one address; the environment
            variable HIMPC_LAB_TOKEN may contain the token instead.
        one_of_several: answer 503 while all places are used, so that the reverse proxy tries the next server;
            docs/serving.md describes such a proxy.
        drain: time in s for which open pages continue after SIGTERM; new visitors are refused meanwhile.
            Ctrl-C and a second SIGTERM end the server at once.
        proxy_only: admit only a proxy that sends the token in the header X-Himpc-Lab-Token; it may use any
            name for this server. Jupyter's launcher uses this option.
        own_files: folder of the Python and URDF files that you can open from the page; by default the folder
            in which himpc-lab is started. Only the page at the first printed address can open them.
        no_own_files: let no page open files of this machine.
        key: file with a key of 16 characters or more, which signs the progress that learners hand in.
    """
    from app.link.choice import SceneChoice
    from app.web.passes import given_token
    from app.web.server import FIRST, PageServer, ServerOptions
    from app.web.serving import serve as serve_page
    from lessons.own.files import Folder
    from lessons.replay.progress import read_key
    from lessons.scenes.run_spec import tip_with_tool

    if no_own_files and own_files is not None:
        raise InputError("--own-files DIR and --no-own-files contradict each other: leave one out")
    if no_names and not class_:
        raise InputError("--no-names is for a class: add --class, or omit --no-names")
    if class_ and proxy_only and not trusted_origin:
        raise InputError(
            "--class with --proxy-only needs the address of the proxy, where teacher and phones open their "
            "pages: add it, e.g. --trusted-origin https://lab.example.org"
        )
    if not 0.0 <= drain <= 3600.0:
        raise InputError(f"--drain {drain}: give a time from 0 to 3600 s")
    bringing = [name for name, given in (("--lesson", lesson), ("--state", state)) if given is not None]
    if len(bringing) > 1 or (bringing and (scene, urdf, tip, tool, hold) != (None, None, None, None, ())):
        others = "--scene, --urdf, --tip, --tool, --hold and --"
        others += "state" if bringing[0] == "--lesson" else "lesson"
        raise InputError(f"{bringing[0]} brings its own scene and robot: leave out {others}")
    first = scene or ("hold" if urdf else FIRST.run.scene)
    own = SceneChoice.starting(first, urdf, tip_with_tool(tip, tool), controller, task, hold)
    if lesson is not None:
        choice = SceneChoice.opening(lesson).admitting(own)
    elif state is not None:
        from lessons.replay.state import decode

        found = decode(state)
        found = replace(found, run=replace(found.run, files=own.run.files, tasks=own.run.tasks))
        choice = SceneChoice.of_state(found).admitting(own)
    else:
        choice = own
    file = None
    if class_ and not no_names and port:  # at port 0, no address is the same after a new start
        from app.web.class_file import class_file

        file = class_file(host, port, choice, classroom)
    server = PageServer(
        choice,
        ServerOptions(
            host=host,
            port=port,
            max_sessions=max_sessions,
            classroom=classroom,
            trusted_origins=trusted_origin,
            ask_token=not no_token,
            own_files=None if no_own_files else Folder.at(own_files or "."),
            key=None if key is None else read_key(key),
            token=given_token(token_file, os.environ),
            refers=one_of_several,
            class_names=not no_names if class_ else None,
            proxy_only=proxy_only,
            embed_in=embed_in,
            class_file=file,
        ),
    )
    return serve_page(server, open_browser=not no_browser, drain=drain)
