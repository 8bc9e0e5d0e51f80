"""The names of viser's page that our scripts and styles use. viser documents none of them. A test
(tests/app/test_app_viser.py) looks for them in the sources of its page, and `pyproject.toml` admits only
versions that have them."""

PAGE = "window.__viserMutable"
"""The object of viser's page that sends messages."""
CHART, CHART_TITLE, CHART_BOX = ".uplot", ".u-title", ".uplot-container"
NUMBER_BOX, SLIDER_LABEL = ".mantine-NumberInput-root", ".mantine-Slider-label"
BUTTON_INNER, BUTTON_LABEL = ".mantine-Button-inner", ".mantine-Button-label"
SHEET = 'div[style*="width: 20em"]'
"""The sheet of controls at the bottom of a phone's screen."""
ROW = ".mantine-Flex-root"
"""A control with its label."""
CHECKBOX = ".mantine-Checkbox-root"
ICON_BUTTON, CLOSES_NOTICE = ".mantine-ActionIcon-root", ".mantine-Notification-closeButton"
SCROLLS = ".mantine-ScrollArea-viewport"
FLOATING_PANEL = '.mantine-Paper-root[style*="position: absolute"]'
FOLDED_PANEL = "[data-dock-bar]"
"""The bar of a folded panel. viser calls it a list of tabs, although it has a button that unfolds it."""
STORED = "viser-user:"
"""The prefix that viser adds to the keys of values that a browser stores."""
