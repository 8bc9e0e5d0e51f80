"""Every number of ours in docs/results.md and docs/house.md equals a number that `reproduce` measured and
stored."""

from __future__ import annotations

import re
from pathlib import Path

from himpc.limits import POSITION_MARGIN, Limits
from himpc.limits.velocity import REACTION
from lessons.papers.himpc_paper.adaptation import CASES, FIGURES, Case, quantity
from lessons.papers.stored import stored
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.run_spec import RunSpec

DOCS = Path(__file__).parents[2] / "docs"
TEXT = (DOCS / "results.md").read_text(encoding="utf-8")
MEMORY = stored(False)


def of(item: str, row: str) -> float:
    """Returns the stored number of a row or of a check."""
    memory = MEMORY[item]
    return memory.rows[row][0] if row in memory.rows else memory.checks[row][0]


def factor(rule: str, over: str = "ST") -> float:
    """Returns the ratio of an architecture's execution time to that with two tasks at a time."""
    return of("htmpc-fig-9", f"{over}/HT execution time, mean over the layouts completed, {rule}")


def power(value: float) -> str:
    """Returns a number with two digits and a power of ten."""
    return re.sub(r"e-0", "e-", f"{value:.1e}")


def plain(value: float, digits: int) -> str:
    """Returns a number with a given number of decimals, without a zero before the decimal point."""
    return f"{value:.{digits}f}".removeprefix("0")


def approach(rate: str) -> str:
    return power(of("himpc-table-3", f"HIMPC, RT2, velocity_approach = {rate}: level-1 RMSE"))


def trend(what: str) -> str:
    rows = (f"R on {what}: HIMPC, N = {N}, over HIMPC with N = 5" for N in (10, 20, 30))
    return ", ".join(plain(of("himpc-table-6", row), 3) for row in rows)


def expected() -> dict[str, str]:
    """Returns the entries of our column, each with the entry of the first column as its key."""
    fig_11, table_5 = "himpc-fig-11", "himpc-table-5"
    ratios = [of("himpc-table-2", f"{c} over HIMPC, {axis}") for c in ("OSF", "HQP") for axis in "xy"]
    own = of("himpc-table-3", "HIMPC, RT2, velocity_approach = 8, the scene's own: level-1 RMSE")
    hqp = own / of(fig_11, "RT2: level-1 RMSE, HIMPC's over HQP's")
    speed = of("himpc-table-3", "HQP, RT2: joint speed over its bound, 1.5 to 10")
    lost = [of("himpc-conflict", f"{c} on RT2: control is lost at") for c in ("OSF", "TDEOSF")]
    softened = of(table_5, "QPs of the 12 000 that had to be softened, 1 to 10")
    inertia = "links' rotational inertia scaled: {}, disturbed over nominal"
    changes = sorted(round(100 * (1 - of(table_5, inertia.format(axis)))) for axis in "xyz")
    coarse = [of("himpc-table-8", f"S at {r}e-3° (benchmark 0.01e-3°)") for r in ("0.5", "1", "2", "5", "10")]
    high = "EE error with (12) over that with (11), high δ, formulation A"
    matched = "Part 2: HTMPC better than HTIDKC tuned to the same Part 1, formulation C"
    authors = "Part 2: HTMPC better than HTIDKC with the authors' gains, formulation A"
    return {
        "RT1 (`planar3-circle`), level 1: HIMPC, TDEOSF": ", ".join(
            power(of("himpc-table-2", f"{c}, y")) for c in ("HIMPC", "TDEOSF")
        )
        + " m",
        "RT1, level 1: OSF and HQP over HIMPC": f"{min(ratios):.0f} to {max(ratios):.0f} ×",
        "RT2 (`planar3-conflict`): HIMPC": f"{power(own)} m on level 1, inside all bounds, with "
        f"`velocity_approach` 8, the scene's value; {approach('15, the default elsewhere')} with the default "
        f"15, {approach('0, as printed')} with 0, as printed",
        "Level 1, RT2 over RT1: HIMPC, HQP": f"{of(fig_11, 'HIMPC: level-1 RMSE in RT2 over RT1'):.1f}, "
        f"{of(fig_11, 'HQP: level-1 RMSE in RT2 over RT1'):.1f}",
        "RT2: HQP": f"{power(hqp)} m at {speed:.1f} × the speed limit",
        "RT2: OSF, TDEOSF": f"lose control at {lost[0]:.1f} s and {lost[1]:.1f} s",
        "RT3 (`planar3-singular`), from the straight arm: HIMPC": power(
            of("himpc-fig-15", "HIMPC, y: RMSE over the whole run")
        )
        + " m on level 1, no unsolved QP",
        f"RT4 (`iiwa14-circle-paper`, position rows as printed: {softened:.0f} of 12 000 QPs softened), q₁": (
            f"{of(table_5, 'nominal: q₁'):.2f}°"
        ),
        "RT4, x, y, z in 10⁻⁴ m": ", ".join(f"{1e4 * of(table_5, f'nominal: {axis}'):.2f}" for axis in "xyz"),
        "Table V, links' rotational inertia ± 20 %: level 1 changes by": f"−{changes[0]} to −{changes[-1]} %",
        "Table VI, error at N = 10, 20, 30 over N = 5: R on Δτ as printed": trend("Δτ, as printed"),
        "Table VI, R on M̄⁻¹Δτ, `limits.position=viability`": trend("M̄⁻¹Δτ, with viability"),
        "Table VII, NHIMPC's median time over HIMPC's": (
            f"{of('himpc-table-7', 'NHIMPC over HIMPC, median'):.1f} (2 to 3 iterations)"
        ),
        "Table VIII, roughness over encoder resolution, N·m": ", ".join(
            plain(each, 2 if each < 10 else 1) for each in coarse
        ),
        "HTMPC, formulation A (as printed): hand's error, (12) over (11), high δ": (
            f"{of('htmpc-table-1', high):.1f}"
        ),
        "HTMPC, formulation C (the default), over HTIDKC tuned to the same first part, part 2": (
            f"{of('htmpc-fig-6', matched):.0%} better".replace("%", " %")
        ),
        "HTMPC, formulation A, over HTIDKC with the authors' gains, part 2": (
            f"{of('htmpc-fig-6', authors):.0%} better".replace("%", " %")
        ),
        'Delivery, time with base and arm in turn (the paper\'s "decoupled") over hierarchical: base within '
        "5 cm and at rest": f"{factor('both within 5 cm and at rest', 'decoupled'):.1f}",
    }


def test_the_table_is_what_was_measured() -> None:
    lines = re.findall(r"^\| (.+?) \| (.+?) \| .+? \|$", TEXT.partition("\n## ")[0], re.MULTILINE)
    assert dict(lines) == expected()


def test_the_payloads_are_what_was_measured() -> None:
    """The table of M̄ that is adapted to the payload equals the stored numbers, to three digits each."""

    def cell(case: Case, words: str, what: str) -> str:
        value = of("himpc-adaptation", quantity(case, words, what))
        return f"{value:.0f}" if what.startswith("ticks") or value >= 100 else f"{value:.3g}"

    for case in CASES:
        cells = [cell(case, words, what) for words in ("as set", "M_bar_adapt=true") for what in FIGURES]
        assert f"| {case.words} | {' | '.join(cells)} |" in TEXT


def test_one_round_is_what_the_table_says() -> None:
    """The table of the deliveries contains the measured seconds for each rule and architecture."""
    rules = {"within 80 cm": (), "within 5 cm and at rest": ("base_tolerance=0.05", "base_at_rest=true")}
    for words, rule in rules.items():
        times = []
        for architecture in ("hierarchical", "single_task", "decoupled"):
            asked = ("rounds=1", f"architecture={architecture}", *rule)
            told = summary(run(RunSpec("ridgeback-ur10-delivery", set=asked).prepared()))
            times.append(told["completion_time_s"])
        factors = (f"{time / times[0]:.2f}" for time in times[1:])
        cells = (*(f"{time:.1f}" for time in times), *factors)
        assert f"| {words} | {' | '.join(cells)} |" in TEXT
    text = " ".join(TEXT.split())
    first, second = (f"{factor(f'both within {rule}'):.2f} times" for rule in ("80 cm", "5 cm and at rest"))
    assert f"{first} as long within 80 cm and {second} within 5 cm and at rest" in text
    assert f"it would be {factor('ST within 5 cm and at rest, HT within 80 cm'):.2f}" in text


def test_the_departures_from_the_printed_limits_are_the_ones_that_run() -> None:
    """docs/house.md names the constants in use, and the violation of the limit that they prevent."""
    text = " ".join((DOCS / "house.md").read_text(encoding="utf-8").split())
    rate, T_s = Limits().velocity_approach, 1e-3
    over = of("himpc-limits", "nominal, as printed: largest velocity over its limit") - 1.0
    for told in (
        f"{REACTION:g}/`velocity_approach` ({T_s + REACTION / rate:.2f} s)",
        f"{1e3 * POSITION_MARGIN:g} mrad",
        f"`limits.velocity_approach` ({rate:g} 1/s)",
        f"overrun by {over:.0%}".replace("%", " %"),
    ):
        assert told in text, told
