"""The rules of the architecture: imports have one direction, and each heavy dependency is imported in one
place."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ORDER = ("robots", "himpc", "lessons", "app", "himpc_lab", "tests")
"""Each package may import itself and the packages before it."""

DOORS = {
    "mujoco": ("robots/plant.py", "robots/mechanics/", "robots/mjcf/"),
    "daqp": ("himpc/qp.py",),
    "proxsuite": ("himpc/qp.py",),
    "placo": ("himpc/htmpc/placo_control.py",),
    "numba": ("himpc/compilation/",),
    "llvmlite": ("himpc/export/objects.py",),
    "casadi": ("himpc/qp.py",),
    "viser": ("app/",),
    "segno": ("app/classes/sockets.py",),
    "tyro": ("app/",),
    "rich": ("app/",),
    "matplotlib": ("lessons/plots/",),
    "distributed": ("lessons/cluster.py",),
    "IPython": ("app/jupyter/lab.py",),
    "jupyter_core": ("app/jupyter/lab.py",),
    "psutil": ("robots/processes/family.py",),
    "yourdfpy": ("robots/shapes/read.py",),
    "pyseccomp": ("lessons/exercises/inside/confine.py",),
    "py_landlock": ("lessons/exercises/inside/confine.py",),
}


def sources(*packages: str) -> list[Path]:
    return sorted(path for package in packages for path in (ROOT / package).rglob("*.py"))


@cache
def tree(path: Path) -> ast.Module:
    """Returns the syntax tree of a file, cached."""
    return ast.parse(path.read_text())


@cache
def imports(path: Path) -> frozenset[str]:
    """Returns every module or name that a file imports, in dotted form, including imports inside functions
    and for types."""
    found: set[str] = set()
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
        elif (
            isinstance(node, ast.Call)
            and getattr(node.func, "attr", getattr(node.func, "id", "")) in ("import_module", "__import__")
            and node.args
            and isinstance(node.args[0], ast.Constant)
        ):
            found.add(str(node.args[0].value))
    return frozenset(found)


def within(name: str, package: str) -> bool:
    return name == package or name.startswith(f"{package}.")


@pytest.mark.parametrize("package", ORDER[:-1])
def test_imports_go_one_way(package: str) -> None:
    """Imports go in the direction tests → app → lessons → himpc → robots, never back."""
    later = ORDER[ORDER.index(package) + 1 :]
    files = sources(package)
    assert files
    wrong = {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in files
        for name in imports(path)
        for other in later
        if within(name, other)
    }
    assert not wrong


def test_himpc_is_tested_without_lessons_and_app() -> None:
    """The tests of himpc do not import lessons or app, and thus show that himpc can be used as a library."""
    files = sources("tests/himpc")
    assert files
    assert not {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in files
        for name in imports(path)
        if within(name, "lessons") or within(name, "app")
    }


APP = {
    "commands": ("web", "html", "link", "__main__"),
    "jupyter": ("web", "client", "link"),
    "web": ("classes", "page", "panels", "tab", "client", "html", "link", "worker", "adapter"),
    "classes": ("client", "html", "link"),
    "page": ("panels", "view", "tab", "client", "html", "link", "adapter"),
    "panels": ("view", "tab", "client", "html", "link", "adapter"),
    "view": ("tab", "client", "html", "link", "adapter"),
    "tab": ("client", "html", "link", "adapter"),
    "client": ("html", "link"),
    "worker": ("link",),
    "link": (),
    "html": (),
    "adapter": (),
}
"""The folders that each folder of app/ may import beside itself: page and simulation meet only in `link`.
Only `web` imports both; it passes the entry point of the simulation on."""


def test_app_is_the_folders_it_says() -> None:
    """Every folder of app/ has an entry in `APP`, and app/ contains only two other files."""
    folders = {path.name for path in (ROOT / "app").iterdir() if path.is_dir() and path.name[0] not in "._"}
    assert folders == set(APP)
    assert {path.name for path in (ROOT / "app").glob("*.py")} == {"__init__.py", "__main__.py"}


def test_the_way_through_app_names_files_that_are_there() -> None:
    """The files that app/__init__.py names on the path of a target and of a row exist."""
    told = ast.get_docstring(tree(ROOT / "app" / "__init__.py")) or ""
    named = set(re.findall(r"`(\w+/\w+)`", told))
    assert len(named) >= 10
    assert {name for name in named if not (ROOT / "app" / f"{name}.py").exists()} == set()


def test_contributing_names_what_is_there() -> None:
    """The files and functions that the walks and recipes of CONTRIBUTING.md name exist."""
    text = (ROOT / "CONTRIBUTING.md").read_text()
    paths = {each for each in re.findall(r"`([\w./]+/[\w./]*)`", text) if "NAME" not in each}
    paths |= set(re.findall(r"\btests/[\w/]+(?:\.py)?", text))
    assert len(paths) > 20
    assert {each for each in paths if not (ROOT / each).exists()} == set()
    walks = re.findall(r"`([\w.]+)` in `([\w./]+)`", text)
    assert walks
    for name, file in walks:
        assert f"def {name.rpartition('.')[2]}(" in (ROOT / file).read_text()


@pytest.mark.parametrize("folder", APP)
def test_page_and_simulation_meet_in_link_only(folder: str) -> None:
    """Imports go in the direction commands → web → page → panels → view → tab → client → link ← worker. A
    folder imports only the folders that `APP` lists for it."""
    files = sources(f"app/{folder}")
    assert files
    wrong = {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in files
        for name in imports(path)
        if within(name, "app") and name.split(".")[1] not in (folder, *APP[folder])
    }
    assert not wrong


LESSONS = {
    "events": (),
    "own": (),
    "outputs": (),
    "examples": (),
    "plots": ("outputs",),
    "parallel": (),
    "cluster": ("parallel",),
    "settings": ("events", "own"),
    "scenes": ("settings", "events", "own"),
    "session": ("scenes", "settings", "events", "own"),
    "runs": ("session", "scenes", "settings", "events", "own"),
    "scenes/run_spec": ("runs", "scenes", "events"),
    "recording": ("session", "scenes", "settings", "events"),
    "geometry": ("session",),
    "teaching": ("recording", "scenes/run_spec", "scenes", "settings", "events", "parallel"),
    "experiments": (
        *("recording", "scenes/run_spec", "session", "scenes", "settings", "events", "own", "parallel"),
        *("plots", "outputs"),
    ),
    "course": ("teaching", "events"),
    "exercises": (
        *("teaching", "recording", "scenes/run_spec", "session", "scenes", "settings", "events", "own"),
        *("parallel", "outputs"),
    ),
    "authoring": (
        *("course", "exercises", "teaching", "scenes/run_spec", "runs", "scenes", "events", "own"),
        "outputs",
    ),
    "replay": ("course", "scenes/run_spec", "scenes", "settings", "events", "own"),
    "papers": ("replay", "experiments", "scenes/run_spec", "scenes", "settings", "plots", "outputs"),
}
"""The parts that each part of lessons/ may import beside itself. A run names its scene, which may be that of
a file, and only a trial in a session shows whether such a file can be used; therefore runs are above
sessions."""


def lessons_part(name: str) -> str:
    """Returns the part of lessons/ that a dotted name belongs to."""
    words = name.split(".")
    here = [ROOT / "lessons" / f"{word}{end}" for word in words[1:2] for end in ("", ".py")]
    if here and not any(place.exists() for place in here):
        words = origins(ROOT / "lessons" / "__init__.py")[words[1]].split(".")  # the package exports it
    return next((part for k in (3, 2) if (part := "/".join(words[1:k])) in LESSONS), "")


@pytest.mark.parametrize("part", LESSONS)
def test_lessons_are_built_in_one_direction(part: str) -> None:
    """Imports go in the direction settings, events ← scenes ← session ← runs ← teaching, experiments ←
    course, papers."""
    files = [path for path in sources("lessons") if lessons_part(dotted(path)) == part]
    assert files
    wrong = {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in files
        for name in imports(path)
        if within(name, "lessons") and lessons_part(name) not in (part, *LESSONS[part])
    }
    assert not wrong


def test_lessons_have_no_other_parts() -> None:
    """Every file belongs to one part."""
    assert {path for path in sources("lessons") if not lessons_part(dotted(path))} == {
        ROOT / "lessons" / "__init__.py"
    }


def dotted(path: Path) -> str:
    """Returns the name of a file's module."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


ROBOTS = {
    "arrays": (),
    "errors": (),
    "lazy": (),
    "report": (),
    "signals": (),
    "inertia": (),
    "catalog": (),
    "ranges": ("errors",),
    "settings": ("ranges", "errors"),
    "processes": ("errors",),
    "meshes": ("processes", "report", "errors"),
    "joints": ("arrays",),
    "urdf": ("meshes", "inertia", "joints", "report", "errors"),
    "mjcf": ("urdf", "meshes", "report", "errors"),
    "geometry": (),
    "robot": ("geometry", "urdf", "joints", "report", "errors"),
    "per_robot": ("robot",),
    "reach": (
        "arrays",
        "robot",
    ),
    "truth": ("robot", "joints", "settings"),
    "nominal": ("arrays", "truth", "robot", "inertia", "settings", "ranges"),
    "collision": ("arrays", "joints", "geometry", "robot", "errors"),
    "world": ("collision", "ranges", "errors"),
    "cover_shapes": ("arrays", "collision", "per_robot", "robot", "geometry"),
    "shapes": ("arrays", "joints", "truth", "per_robot", "robot", "geometry", "meshes"),
    "mechanics": (
        *("joints", "world", "collision", "truth", "robot", "geometry", "inertia", "settings", "errors"),
    ),
    "floor": ("mechanics", "world", "collision", "robot"),
    "covering": ("arrays", "mechanics", "shapes", "per_robot", "robot", "geometry"),
    "plant": (
        *("arrays", "joints", "mechanics", "world", "truth", "robot", "settings", "signals", "errors"),
    ),
    "servo": ("plant", "robot", "settings", "ranges", "signals"),
    "loading": (
        *(
            "joints",
            "collision",
            "plant",
            "covering",
            "floor",
            "mechanics",
            "shapes",
            "robot",
            "geometry",
            "mjcf",
            "urdf",
        ),
        *("meshes", "processes", "catalog", "inertia", "report", "errors"),
    ),
}
"""The files and folders that each file or folder of robots/ may import beside itself. A robot contains its
geometry as data; the plant and the geometry of an imported robot are made from the robot, above it."""


@pytest.mark.parametrize("part", ROBOTS)
def test_robots_are_built_in_one_direction(part: str) -> None:
    """Imports go in the direction errors, urdf, mjcf, geometry ← robot ← world, shapes ← mechanics ←
    covering, plant ← loading. Imports for types and inside functions count as well."""
    assert not against_the_order("robots", part)


def test_robots_have_no_other_parts() -> None:
    """Every file belongs to one part, and each import that `ROBOTS` allows occurs."""
    files = sources("robots")
    assert outside_all_parts("robots") == {ROOT / "robots" / "__init__.py"}
    used = {
        (part_of(path), part_of(home_of(name)))
        for path in files
        for name in imports(path)
        if within(name, "robots")
    }
    assert {(part, each) for part, below in ROBOTS.items() for each in below} <= used


@pytest.mark.parametrize("package", ["robots", "himpc", "lessons", "app"])
def test_files_do_not_import_each_other(package: str) -> None:
    """There are no import cycles; imports for types and inside functions count as well."""
    below = {
        path: {home_of(name) for name in imports(path) if within(name, package)} - {path}
        for path in sources(package)
    }
    TopologicalSorter(below).prepare()  # raises CycleError


HIMPC_ROOT = ("catalog", "constants", "prediction", "printed", "qp", "rotation", "stack", "telemetry")
"""Files of himpc/ outside its folders; they have their place in the order as well."""
THEORY = {
    "catalog": (),
    "constants": (),
    "qp": (),
    "rotation": (),
    "references": ("rotation", "constants"),
    "kinematics": ("references",),
    "tasks": ("kinematics", "references", "rotation"),
    "stack": ("tasks", "kinematics"),
    "prediction": (),
    "limits": ("prediction", "qp", "constants"),
    "cascade": ("limits", "qp", "constants"),
    "printed": ("cascade", "qp", "constants"),
    "formulation": (
        *("cascade", "limits", "prediction", "stack", "tasks", "kinematics", "references"),
        *("qp", "catalog", "constants"),
    ),
    "telemetry": ("cascade", "stack", "kinematics", "constants"),
    "plan": ("telemetry", "cascade", "limits", "tasks", "references", "rotation", "constants"),
    "missions": ("tasks", "kinematics", "references", "rotation"),
}
"""The parts that each part of himpc/ without compiled code may import beside itself."""
COMPILED = {
    "compilation": (),
    "tick/kernel": ("compilation", "constants"),
    "htmpc/kernel": ("tick/kernel", "compilation", "constants"),
    "tick": (
        *("tick/kernel", "plan", "telemetry", "formulation", "printed", "cascade", "limits", "prediction"),
        *("tasks", "kinematics", "references", "qp", "constants"),
    ),
    "controllers": (
        *("tick", "tick/kernel", "plan", "formulation", "printed", "cascade", "limits", "prediction"),
        *("stack", "tasks", "kinematics", "references", "qp", "catalog", "constants"),
    ),
    "export/kernel": (
        *("tick/kernel", "htmpc/kernel", "tick", "controllers", "limits", "cascade", "compilation", "qp"),
        "constants",
    ),
    "export": (
        *("export/kernel", "tick", "tick/kernel", "compilation", "controllers", "formulation", "cascade"),
        *("limits", "references", "tasks", "stack"),
    ),
    "htmpc": (
        *("htmpc/kernel", "tick/kernel", "plan", "stack", "tasks", "kinematics", "references"),
        *("rotation", "qp"),
    ),
}
"""The order of the compiled parts and of the parts that run them."""
HIMPC = THEORY | COMPILED


def part_of(path: Path) -> str:
    """Returns the part of robots/ or himpc/ that a file belongs to, or "" for the package itself."""
    package, *names = path.relative_to(ROOT).with_suffix("").parts
    parts = {"robots": ROBOTS, "himpc": HIMPC}.get(package, {})
    return next(("/".join(names[:k]) for k in (2, 1) if "/".join(names[:k]) in parts), "")


def home_of(name: str) -> Path:
    """Returns the file that an imported name comes from."""
    parts = name.split(".")
    places = (ROOT.joinpath(*parts[:k]) for k in range(len(parts), 0, -1))
    files = (file for place in places for file in (place.with_suffix(".py"), place / "__init__.py"))
    return next(file for file in files if file.exists())


def against_the_order(package: str, part: str) -> set[str]:
    """Returns the imports of a part of robots/ or himpc/ that its table does not list."""
    files = [path for path in sources(package) if part_of(path) == part]
    assert files
    allowed = (part, *{"robots": ROBOTS, "himpc": HIMPC}[package][part])
    return {
        f"{path.relative_to(ROOT)} imports {name}"
        for path in files
        for name in imports(path)
        if within(name, package) and part_of(home_of(name)) not in allowed
    }


def outside_all_parts(package: str) -> set[Path]:
    """Returns the files of robots/ or himpc/ that belong to no part."""
    return {path for path in sources(package) if not part_of(path)}


@pytest.mark.parametrize("part", HIMPC)
def test_himpc_is_built_in_one_direction(part: str) -> None:
    """Imports go in the direction references, kinematics, tasks, limits ← cascade ← formulation, plan ← tick
    ← controllers; htmpc."""
    assert not against_the_order("himpc", part)


def test_himpc_has_no_other_parts() -> None:
    """Every file belongs to one part, and the tables have no cycles."""
    assert outside_all_parts("himpc") == {ROOT / "himpc" / "__init__.py"}
    assert {path.stem for path in (ROOT / "himpc").glob("*.py")} == {"__init__", *HIMPC_ROOT}
    assert not {
        (a, b)
        for table in (ROBOTS, HIMPC, APP, LESSONS)
        for a, below in table.items()
        for b in below
        if a in below_of(table, b)
    }


def below_of(table: dict[str, tuple[str, ...]], part: str) -> set[str]:
    """Returns all parts that a part may import, directly or through others."""
    found: set[str] = set()
    waiting = [*table.get(part, ())]
    while waiting:
        each = waiting.pop()
        if each not in found:
            found.add(each)
            waiting += table.get(each, ())
    return found


def test_the_theory_imports_nothing_compiled() -> None:
    """The equations can be read and run without a compiler: no part of the theory imports a compiled part,
    directly or through others."""
    assert not {(part, each) for part in THEORY for each in below_of(HIMPC, part) if each in COMPILED}


PRIVATE_OF_NUMBA = {"private", "private_views", "pieces", "keeping"}


def test_few_files_touch_private_names_of_numba() -> None:
    """Only four files of the tool chain use private names of `numba`. The other files still work if these
    names change."""
    touching, using = set(), set()
    for path in sources("himpc/compilation"):
        of_numba = {name for name in imports(path) if within(name, "numba")}
        using |= {path.stem} if of_numba else set()
        touching |= {path.stem} if any(name.count(".") > 1 for name in of_numba) else set()
    assert touching == PRIVATE_OF_NUMBA
    assert using - touching == {"compiled", "public"}
    told = ast.get_docstring(tree(ROOT / "himpc/compilation/__init__.py")) or ""
    assert set(re.findall(r"`(\w+)`", told)) >= PRIVATE_OF_NUMBA


NO_PICTURE = ("worker", "link", "client", "html")


@pytest.mark.parametrize("folder", NO_PICTURE)
def test_what_needs_no_picture_knows_no_viser(folder: str) -> None:
    """The simulation does not load viser, and the state of the page is plain data."""
    assert not {name for path in sources(f"app/{folder}") for name in imports(path) if within(name, "viser")}


THREADS = "app/link/threads.py"


def test_a_function_that_runs_on_a_thread_of_its_own_says_so() -> None:
    """Threads are started by `on_thread`, and a function that is written for a thread says so by its name.
    Other functions, such as another object's `close`, may run on any thread."""
    files = sources("app")
    assert {str(path.relative_to(ROOT)) for path in files if "Thread(" in path.read_text()} == {THREADS}
    for path in files:
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "on_thread":
                function = ast.unparse(node.args[1])
                own = function.startswith("self.") or "." not in function
                assert function.endswith("_on_thread") or not own, f"{path.name} runs {function} on a thread"


PRIVATE = "app/adapter/private.py"


def test_one_file_touches_private_names_of_viser() -> None:
    """A private name, with one leading underscore, is used only by its own class or in the one file that
    has them all, see tests/app/test_app_viser.py."""
    files = sources(*(f"app/{folder}" for folder in APP if folder not in NO_PICTURE))
    touching: dict[str, set[str]] = {}
    ours = {"_exit"}  # `_exit` is a public name of os
    for path in files:
        name = str(path.relative_to(ROOT))
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.Attribute) and is_private(node.attr):
                of = node.value
                inside = isinstance(of, ast.Name) and of.id in ("self", "cls")
                if inside or (isinstance(of, ast.Call) and getattr(of.func, "id", "") == "super"):
                    ours.add(node.attr)
                else:
                    touching.setdefault(node.attr, set()).add(name)
            elif isinstance(node, ast.FunctionDef) and is_private(node.name):
                ours.add(node.name)
        if any(within(module, "viser") and "._" in module for module in imports(path)):
            touching.setdefault("import", set()).add(name)
    assert "_websock_server" in touching, "the test sees nothing any more"
    foreign = {attribute: names for attribute, names in touching.items() if attribute not in ours}
    assert {name for names in foreign.values() for name in names} == {PRIVATE}


def test_one_file_has_the_names_of_visers_page() -> None:
    """Scripts and styles use the constants of one module, which tests/app/test_app_viser.py checks."""
    name = re.compile(r"__viser\w|mantine-[A-Z]|\.uplot|\.u-\w|20em")
    files = {str(path.relative_to(ROOT)) for path in sources("app") if name.search(path.read_text())}
    assert files == {"app/adapter/names.py"}


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


@pytest.mark.parametrize("library", DOORS)
def test_heavy_dependencies_have_one_door(library: str) -> None:
    """A library is imported only in the files or folders of its entry in `DOORS`, and at least once."""
    users = {
        str(path.relative_to(ROOT))
        for path in sources(*ORDER[:-1])
        if any(within(name, library) for name in imports(path))
    }
    assert users
    assert all(user.startswith(DOORS[library]) for user in users)


def test_what_is_imported_is_declared() -> None:
    """Every imported package is declared as a dependency, also if another package would install it anyway."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    wanted = [
        *project["dependencies"],
        *(each for extra in project["optional-dependencies"].values() for each in extra),
    ]
    declared = {re.split(r"[^\w-]", each)[0] for each in wanted}
    used = {name.partition(".")[0] for path in sources(*ORDER[:-1]) for name in imports(path)}
    used -= {*ORDER, *sys.stdlib_module_names}
    assert {"numpy", "pinocchio"} <= used
    packages = {"pinocchio": "pin", "markdown_it": "markdown-it-py", "IPython": "ipython"}
    assert {packages.get(name, name.replace("_", "-")) for name in used} <= declared


def test_the_oracle_of_the_clearances_stays_in_the_tests() -> None:
    """The packages compute distances in closed form; only tests use the collision library, as a check."""
    packages, tests = (
        any(within(name, "coal") for path in sources(*where) for name in imports(path))
        for where in (ORDER[:-1], ORDER[-1:])
    )
    assert tests
    assert not packages


def test_the_controller_cannot_peek() -> None:
    """himpc never imports the plant, so that a controller cannot use the true mechanics."""
    names = {name for path in sources("himpc") for name in imports(path)}
    assert names
    plant = ("robots.plant", "robots.mechanics")
    peeking = {
        name
        for name in names
        if any(within(name, part) for part in plant) or name in ("robots.Plant", "robots.*")
    }
    assert not peeking
    truth = {name for name in names if within(name, "robots.truth") or within(name, "robots.inertia")}
    assert not truth


KIND = re.compile(r"(Torque|Velocity)(Scene|Settings|Session|Run|Face)|SESSIONS")
MAY_ASK = ("lessons/scenes/catalog.py", "lessons/session/torque.py", "lessons/session/velocity.py")


def test_who_tells_torque_from_velocity() -> None:
    """Only the catalog and the two sessions distinguish the two kinds; all other code uses one table."""
    asking = {str(path.relative_to(ROOT)) for path in sources("lessons", "app") if asks_for_kind(path)}
    assert "lessons/scenes/catalog.py" in asking, "the test sees nothing any more"
    assert asking <= set(MAY_ASK)


def asks_for_kind(path: Path) -> bool:
    """Whether a file tests for, compares with, or matches a class of one kind (torque or velocity)."""
    for node in ast.walk(tree(path)):
        about: list[ast.AST] = []
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("isinstance", "issubclass"):
            about = [node.args[1]]
        elif isinstance(node, ast.Compare):
            about = [node]
        elif isinstance(node, ast.MatchClass):
            about = [node.cls]
        named = (name for each in about for name in ast.walk(each))
        if any(KIND.fullmatch(getattr(n, "id", getattr(n, "attr", ""))) for n in named):
            return True
    return False


EXTENDED = ("himpc/controllers/himpc.py:HIMPC", "himpc/htmpc/htmpc.py:HTMPC")
"""The papers describe the variants (HIQP, NHIMPC, …; STMPC, HTMPC_WPT) by their differences from these two
classes."""


def test_classes_are_abstract_or_final() -> None:
    """Every class that is subclassed has an abstract method or is an abstract base or protocol, except those
    in EXTENDED."""
    classes = {(path, each.name): each for path in sources(*ORDER[:-1]) for each in classes_of(path)}
    lines: dict[tuple[Path, str], list[tuple[Path, str]]] = {}
    for path, name in classes:
        modules = origins(path)
        for word in words_of(classes[path, name].bases):
            own = [key for key in classes if key[1] == word and (key[0] == path or word not in modules)]
            far = [key for key in classes if key[1] == word and stands_in(key[0], modules.get(word, ""))]
            lines.setdefault((path, name), []).extend(far or [key for key in own if key[0] == path])
    extended = {base for bases in lines.values() for base in bases}
    assert len(extended) > 10, "the test sees nothing any more"

    def missing(key: tuple[Path, str]) -> set[str]:
        body = classes[key].body
        own = {each.name: each for each in body if isinstance(each, ast.FunctionDef)}
        abstract = {name for name, each in own.items() if "abstractmethod" in words_of(each.decorator_list)}
        return {m for base in lines.get(key, ()) for m in missing(base) if m not in own} | abstract

    concrete = {
        f"{path.relative_to(ROOT)}:{name}"
        for path, name in extended
        if not missing((path, name)) and not {"ABC", "Protocol"} & set(words_of(classes[path, name].bases))
    }
    assert concrete == set(EXTENDED)
    said = {path for path in sources(*ORDER[:-1]) if "NotImplementedError" in path.read_text()}
    assert said == set()


def classes_of(path: Path) -> list[ast.ClassDef]:
    return [node for node in ast.walk(tree(path)) if isinstance(node, ast.ClassDef)]


def words_of(nodes: list[ast.expr]) -> list[str]:
    """Returns the last word of each dotted name, without subscripts."""
    plain = [node.value if isinstance(node, ast.Subscript) else node for node in nodes]
    return [str(getattr(node, "id", getattr(node, "attr", ""))) for node in plain]


@cache
def origins(path: Path) -> dict[str, str]:
    """Returns the module from which a file imports each name."""
    nodes = [node for node in ast.walk(tree(path)) if isinstance(node, ast.ImportFrom)]
    return {alias.asname or alias.name: str(node.module) for node in nodes for alias in node.names}


def stands_in(path: Path, module: str) -> bool:
    """Whether a file is the given module, or part of the package of that name."""
    return bool(module) and within(".".join(path.relative_to(ROOT).with_suffix("").parts), module)


def test_no_file_names_a_package_index() -> None:
    """No file under version control names a package index; pip uses the index configured on the machine."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    # The patterns are searched one by one: a fixed beginning is found far faster than one of several.
    patterns = [
        *map(re.compile, ("--(extra-)?index[-]url", "--find-links", r"py[p]i\.org", "python[h]osted")),
        re.compile(r"https?://[^\s\"'<>)]*/simple\b"),
    ]
    naming = []
    for name in filter(None, listed.stdout.split("\0")):
        path = ROOT / name
        if path == Path(__file__) or not path.is_file():
            continue
        text = path.read_bytes().decode("utf-8", "ignore")
        if any(pattern.search(text) for pattern in patterns):
            naming.append(name)
    assert not naming
