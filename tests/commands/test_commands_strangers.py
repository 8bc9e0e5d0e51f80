"""URDF files from untrusted sources on the command line: the check and the loading give the same messages,
and names are printed as text."""

from __future__ import annotations

from pathlib import Path

import pytest

from app.__main__ import main

MARKUP = """<robot name="[/red]"><link name="[/b]"/>
<link name="[/red][bold]"/><joint name="[link=x]" type="{}">
<parent link="[/b]"/><child link="[/red][bold]"/></joint></robot>"""


def test_brackets_in_names_are_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "[red]arm.urdf"
    for kind, code in (("revolute", 0), ("[/nothing]", 1)):
        file.write_text(MARKUP.format(kind))
        assert main(["robots", "--check", str(file)]) == code
        assert "[link=x]" in capsys.readouterr().out


def test_a_robot_with_too_many_joints_is_refused_before_it_takes_minutes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The check and the run refuse the robot with the same message."""
    links = "".join(f'<link name="l{k}"/>' for k in range(61))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k in range(60)
    )
    file = tmp_path / "long.urdf"
    file.write_text(f'<robot name="long">{links}{joints}</robot>')
    assert main(["robots", "--check", str(file), "--json", "-"]) == 1
    assert "60 moving joints; at most 20" in capsys.readouterr().out
    assert main(["run", "hold", "--urdf", str(file)]) == 2
    assert "60 moving joints; at most 20" in capsys.readouterr().err
