"""In a large window the plots stand in a row below the robot, which can be seen and dragged above them."""

from __future__ import annotations

from playwright.sync_api import Browser
from served import served

from app.adapter.names import CHART_BOX
from browsing.browser_actions import drag_target, eventually, open_page, point_on_page

SIZE = 1440, 900
ARM = 0.18  # m, the length of an arrow at the target
HEAD = 60  # px, the height of the panel's head


def test_the_plots_stand_in_a_row_below_the_robot(browser: Browser) -> None:
    with served("iiwa14-hold", grace=2.0) as server:
        page = open_page(browser, server.link, *SIZE)
        charts = page.locator(f"{CHART_BOX}:visible")
        assert eventually(page, lambda: charts.count() == 3)
        boxes = [box for box in (chart.bounding_box() for chart in charts.all()) if box is not None]
        tops, lefts = [box["y"] for box in boxes], [box["x"] for box in boxes]
        assert len(set(tops)) == 1 and lefts == sorted(set(lefts))
        assert all(box["height"] > 180 and box["y"] + 180 < SIZE[1] for box in boxes)
        for node, at in (
            ("/actual", (0.0, 0.0, 0.0)),
            ("/target", (0.0, 0.0, 0.0)),
            ("/target", (ARM, 0.0, 0.0)),
        ):
            assert point_on_page(page, node, at)[1] < tops[0] - 60  # the head of the panel
        learner = server.sessions.learners[0]
        before = learner.status
        assert before is not None
        drag_target(page, axis=1, along=0.1)

        def moved() -> bool:
            status = learner.status
            return (
                status is not None
                and abs(status.targets["position"][1] - before.targets["position"][1]) > 0.05
            )

        assert eventually(page, moved)
        page.context.close()
