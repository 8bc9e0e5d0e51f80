"""Malformed and malicious robot descriptions, each with the name of its kind."""

from __future__ import annotations

from collections.abc import Iterator

from arms import INERTIAL, LIMIT, joint, link, robot, two_joint_arm

ARM = two_joint_arm()


def chain(count: int, kind: str = "revolute") -> str:
    """Returns the URDF of links in series, with joints of one type whose effort limits the import must
    estimate."""
    limit = '<limit lower="-1" upper="1" velocity="1" effort="0"/>'
    parts = [link("l0"), *(link(f"l{k + 1}") for k in range(count))]
    parts += [joint(f"j{k}", f"l{k}", f"l{k + 1}", kind, limit, "0 1 0") for k in range(count)]
    return robot(*parts).replace("0.3 0 0.1", "0.05 0 0.01")


def star(count: int) -> str:
    """Returns an arm with many links that are fixed to its second moving link."""
    extra = "".join(link(f"s{k}") + joint(f"f{k}", "l2", f"s{k}", "fixed", "") for k in range(count))
    return two_joint_arm(extra)


def misspelt(count: int) -> str:
    parts = [link("base"), *(link(f"segment_number_{k}") for k in range(count))]
    return robot(*parts, *(joint(f"j{k}", "base", f"segmnet_nubmer_{k}") for k in range(count)))


def bomb(depth: int, where: str) -> str:
    entities = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, depth))
    use = f"&e{depth - 1};"
    inside = f'<link name="{use}"/>' if where == "attribute" else f'<link name="a">{use}</link>'
    return f'<!DOCTYPE r [<!ENTITY e0 "lol">{entities}]><robot name="a">{inside}</robot>'


def visual(shape: str, origin: str = "", times: int = 1) -> str:
    inside = f"{INERTIAL}{f'<visual>{origin}<geometry>{shape}</geometry></visual>' * times}"
    return two_joint_arm(l2=link("l2", inside))


def inertial(mass: str, moments: str, origin: str = "0 0 0") -> str:
    xx, yy, zz, xy, xz, yz = moments.split()
    return two_joint_arm(
        l2=link(
            "l2",
            f'<inertial><origin xyz="{origin}"/><mass value="{mass}"/>'
            f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial>',
        )
    )


def limited(lower: str, upper: str, velocity: str = "3", effort: str = "50", kind: str = "revolute") -> str:
    inside = f'<limit lower="{lower}" upper="{upper}" velocity="{velocity}" effort="{effort}"/>'
    return two_joint_arm(j2=joint("j2", "l1", "l2", kind, inside))


def mimic(inside: str) -> str:
    return two_joint_arm(link("l3") + joint("j3", "l2", "l3", inside=f"{LIMIT}<mimic {inside}/>"))


NUMBERS = (
    "nan",
    "inf",
    "-inf",
    "1e308",
    "-1e308",
    "1e-308",
    "-1",
    "0",
    "",
    "1e400",
    "0x10",
    "1_0",
    "١",
    "1,5",
)


def texts() -> Iterator[tuple[str, str]]:
    """Yields the name and the text of every kind that is a text."""
    # Documents
    yield "empty", ""
    yield "blank", " \n\t "
    yield "half a file", ARM[: len(ARM) // 2]
    yield "two documents", ARM + ARM
    yield "html", "<html><body>404</body></html>"
    yield "JSON", '{"robot": 1}'
    yield "wrong encoding declared", f'<?xml version="1.0" encoding="UTF-16"?>{ARM}'
    yield "unknown encoding declared", f'<?xml version="1.0" encoding="klingon"?>{ARM}'
    yield "namespace", f'<robot xmlns="http://example.org/a" name="a">{link("base")}</robot>'
    yield "billion laughs", bomb(10, "text")
    yield "billion laughs in an attribute", bomb(10, "attribute")
    yield "few laughs in an attribute", bomb(4, "attribute")
    yield (
        "external entity",
        '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="a">&x;</robot>',
    )
    yield "external DTD", f'<!DOCTYPE r SYSTEM "http://127.0.0.1:1/a.dtd">{ARM}'
    yield "parameter entity", '<!DOCTYPE r [<!ENTITY % p SYSTEM "file:///dev/zero"> %p;]><robot name="a"/>'
    yield "deep nesting", two_joint_arm("<link>" * 5_000 + "</link>" * 5_000)
    yield "deep nesting in a link", two_joint_arm(l2=link("l2", "<a>" * 200_000))
    yield "moderate nesting", two_joint_arm(l2=link("l2", INERTIAL + "<a>" * 200 + "</a>" * 200))
    yield "200,000 empty elements", two_joint_arm("<x/>" * 200_000)
    yield "200,000 materials", two_joint_arm('<material name="m"/>' * 200_000)
    yield "50,000 attributes", two_joint_arm("<link " + " ".join(f"a{k}='1'" for k in range(50_000)) + "/>")
    yield "an attribute of 9 MB", two_joint_arm(f'<link name="{"n" * 9_000_000}"/>')
    yield "a comment of 9 MB", two_joint_arm(f"<!--{'n' * 9_000_000}-->")
    yield "11 MB", two_joint_arm(" " * 11_000_000)
    yield "processing instructions", two_joint_arm("<?php die(); ?>" * 10_000)
    yield "CDATA", two_joint_arm("<![CDATA[" + "x" * 1_000_000 + "]]>")
    yield "a gazebo section", two_joint_arm("<gazebo><plugin filename='libevil.so'/></gazebo>")
    yield "a transmission", two_joint_arm("<transmission name='t'/>")
    # Sizes
    yield "2,000 misspelt links", misspelt(2_000)
    yield "900 misspelt links", misspelt(900)
    yield "10,000 fixed links", chain(10_000, "fixed")
    yield "1,001 links", star(998)
    yield "999 links", star(996)
    yield "250 joints in a row", chain(250, "fixed")
    yield "21 moving joints", chain(21)
    yield "20 moving joints", chain(20)
    yield "60 moving joints", chain(60)
    yield "100 sliding joints", chain(100, "prismatic")
    yield (
        "900 mimics",
        two_joint_arm(
            "".join(
                link(f"m{k}")
                + joint(
                    f"k{k}", f"m{k - 1}" if k % 150 else "l2", f"m{k}", inside=f'{LIMIT}<mimic joint="j1"/>'
                )
                for k in range(900)
            )
        ),
    )
    yield "20,000 shapes", visual('<box size="1 1 1"/>', times=20_000)
    yield "5,000 spheres", visual('<sphere radius="1"/>', times=5_000)
    # Names
    yield "a long link name", ARM.replace("l2", "n" * 100_000)
    yield "a long joint name", ARM.replace("j2", "n" * 100_000)
    yield "a long robot name", ARM.replace('"arm"', f'"{"n" * 100_000}"')
    yield "a long misspelt name", two_joint_arm(j2=joint("j2", "n" * 100_000, "l2"))
    yield "a long type", ARM.replace("revolute", "n" * 100_000)
    yield "a long number", ARM.replace("0.3 0 0.1", "9" * 100_000)
    yield "many numbers", ARM.replace("0.3 0 0.1", "0.1 " * 100_000)
    yield "a long mimic", mimic(f'joint="{"n" * 100_000}"')
    yield "a name with line ends", ARM.replace('"l2"', '"l&#10;2"')
    yield "a name with an escape", ARM.replace('"l2"', '"l&#x9b;31m"')
    yield "a name that turns the text", ARM.replace('"l2"', '"l&#x202e;2"')
    yield "markup as a name", ARM.replace('"l2"', '"[/red][bold]"').replace('"j2"', '"[link=x]"')
    yield "HTML as a name", ARM.replace('"l2"', '"&lt;script&gt;alert(1)&lt;/script&gt;"')
    yield "a path as a name", ARM.replace('"l2"', '"../../etc/passwd"')
    yield "a blank name", ARM.replace('"l2"', '" "')
    yield "names alike", ARM.replace('"j1"', '"l1"').replace('"j2"', '"l2"')
    yield "reserved names", ARM.replace('"j1"', '"universe"').replace('"l2"', '"root_joint"')
    yield "a name like a number", ARM.replace('"l2"', '"1"').replace('"j2"', '"nan"')
    # Trees
    yield "a link is its own parent", two_joint_arm(j2=joint("j2", "l2", "l2"))
    yield "a loop", robot(link("a"), link("b"), joint("x", "a", "b"), joint("y", "b", "a"))
    yield (
        "a loop beside the tree",
        two_joint_arm(link("a") + link("b") + joint("x", "a", "b") + joint("y", "b", "a")),
    )
    yield "two roots", two_joint_arm(link("loose"))
    yield "two parents", two_joint_arm(joint("j3", "base", "l2"))
    yield "no parent", ARM.replace('<parent link="l1"/>', "")
    yield "an empty parent", ARM.replace('<parent link="l1"/>', '<parent link=""/>')
    yield (
        "two parents of a joint",
        ARM.replace('<parent link="l1"/>', '<parent link="l1"/><parent link="base"/>'),
    )
    yield "the same link twice", two_joint_arm(link("l2"))
    yield "the same joint twice", two_joint_arm(joint("j2", "l1", "l2"))
    yield "no link", "<robot name='a'/>"
    yield "one link", robot(link("a"))
    yield "nothing moves", chain(3, "fixed")
    yield "floating", two_joint_arm(j2=joint("j2", "l1", "l2", "floating", ""))
    yield "a joint without type", ARM.replace(' type="revolute"', "")
    yield "link in a link", two_joint_arm(l2=link("l2", INERTIAL + link("l9")))
    yield "two inertials", two_joint_arm(l2=link("l2", INERTIAL * 2))
    yield (
        "two limits",
        two_joint_arm(j2=joint("j2", "l1", "l2", inside=LIMIT + LIMIT.replace('"2"', '"nan"'))),
    )
    yield "two axes", two_joint_arm(j2=joint("j2", "l1", "l2", inside=f'{LIMIT}<axis xyz="nan 0 0"/>'))
    yield "two origins", ARM.replace("<origin", '<origin xyz="0 0 0"/><origin')
    # Numbers
    for number in NUMBERS:
        yield f"mass {number}", inertial(number, "1 1 1 0 0 0")
        yield f"a moment {number}", inertial("1", "1 1 1 0 0 0").replace('iyy="1"', f'iyy="{number}"')
        yield f"a product {number}", inertial("1", "1 1 1 0 0 0").replace('ixz="0"', f'ixz="{number}"')
        yield f"centre of mass {number}", ARM.replace('xyz="0.1 0 0"', f'xyz="{number or "x"} 0 0"')
        yield f"origin {number}", ARM.replace("0.3 0 0.1", f"0 0 {number}")
        yield f"rotation {number}", ARM.replace("<origin", f'<origin rpy="0 {number} 0"')
        yield f"axis {number}", ARM.replace('axis xyz="0 1 0"', f'axis xyz="0 {number} 0"')
        yield f"upper limit {number}", limited("-2", number)
        yield f"lower limit {number}", limited(number, "2")
        yield f"velocity {number}", limited("-2", "2", velocity=number)
        yield f"effort {number}", limited("-2", "2", effort=number)
        yield f"a slide's limit {number}", limited("-1", number, kind="prismatic")
        yield f"mimic offset {number}", mimic(f'joint="j1" offset="{number}"')
        yield f"mimic multiplier {number}", mimic(f'joint="j1" multiplier="{number}"')
        yield (
            f"damping {number}",
            two_joint_arm(
                j2=joint(
                    "j2", "l1", "l2", inside=f'{LIMIT}<dynamics damping="{number}" friction="{number}"/>'
                )
            ),
        )
        yield f"a sphere of {number}", visual(f'<sphere radius="{number}"/>')
        yield f"a box of {number}", visual(f'<box size="1 {number} 1"/>')
        yield f"a cylinder of {number}", visual(f'<cylinder radius="{number}" length="{number}"/>')
        yield (
            f"a shape at {number}",
            visual('<sphere radius="1"/>', f'<origin xyz="0 {number} 0" rpy="0 {number} 0"/>'),
        )
        yield f"a mesh times {number}", visual(f'<mesh filename="package://a/b.stl" scale="1 {number} 1"/>')
        yield (
            f"a colour of {number}",
            visual(
                '<sphere radius="1"/></geometry>'
                f'<material name="m"><color rgba="{number} 0 0 1"/></material><geometry>'
            ),
        )
    yield "reversed limits", limited("2", "-2")
    yield "limits below 0", limited("-3", "-2")
    yield "hardly any room", limited("0", "1e-5")
    yield "no room", limited("0.5", "0.5")
    yield "far limits", limited("-1e9", "1e9")
    yield "tiny velocity and effort", limited("-2", "2", "1e-12", "1e-12")
    yield "huge velocity and effort", limited("-2", "2", "1e9", "1e9")
    yield "negative everything", limited("-2", "-3", "-1", "-1").replace('value="1"', 'value="-1"')
    yield "mimics itself", mimic('joint="j3"')
    yield "mimics nobody", mimic('joint="nobody"')
    yield (
        "mimics in a circle",
        two_joint_arm(j2=joint("j2", "l1", "l2", inside=f'{LIMIT}<mimic joint="j1"/>')).replace(
            f'xyz="0 1 0"/>{LIMIT}</joint>', f'xyz="0 1 0"/>{LIMIT}<mimic joint="j2"/></joint>', 1
        ),
    )
    yield "heavy and tiny bodies", inertial("1e5", "1e9 1e9 1e9 0 0 0").replace('value="1"', 'value="1e-6"')
    yield "a needle", inertial("1", "1e-14 1 1 0 0 0")
    yield "a point", inertial("1e-6", "1e-20 1e-20 1e-20 0 0 0")
    yield "a far centre of mass", inertial("1e5", "1 1 1 0 0 0", "1000 1000 1000")
    yield "a long arm", ARM.replace("0.3 0 0.1", "1000 1000 1000")
    yield (
        "axes alike",
        robot(link("base"), link("a", ""), link("b"), joint("x", "base", "a"), joint("y", "a", "b")).replace(
            "0.3 0 0.1", "0 0 0"
        ),
    )
    # Meshes
    for uri in (
        "",
        " ",
        "/etc/passwd",
        "/dev/zero",
        "file:///dev/random",
        "file:///proc/self/mem",
        "../../../../etc/passwd",
        "http://127.0.0.1:1/a.stl",
        "ftp://x/y.stl",
        "package://",
        "package://../../etc/passwd",
        "package:///etc/passwd",
        "package://a/../../../etc/passwd",
        "model://a",
        "data:model/stl;base64,AAAA",
        "\\\\host\\share\\a.stl",
        "a&#10;b.stl",
        "n" * 100_000,
        "package://" + "n" * 100_000 + "/a.stl",
        "package://a/" + "b/" * 50_000 + "c.stl",
    ):
        yield f"mesh {uri[:40]}", visual(f'<mesh filename="{uri}"/>')


def documents() -> dict[str, bytes]:
    """Returns the files of all kinds as bytes, by name."""
    found = {name: text.encode() for name, text in texts()}
    found["UTF-16"] = f'<?xml version="1.0" encoding="UTF-16"?>{ARM}'.encode("utf-16")
    found["UTF-16 without a word"] = ARM.encode("utf-16-le")
    found["UTF-32"] = ARM.encode("utf-32")
    found["UTF-8 with a mark"] = b"\xef\xbb\xbf" + ARM.encode()
    found["Latin-1"] = ARM.replace("l2", "lé").encode("latin-1")
    found["zeros"] = bytes(100_000)
    found["zeros within"] = ARM.encode().replace(b"l2", b"l\0")
    found["an archive"] = b"PK\x03\x04" + bytes(range(256)) * 100
    found["compressed"] = b"\x1f\x8b\x08" + bytes(1000)
    found["an ELF program"] = b"\x7fELF" + bytes(range(256)) * 100
    return found
