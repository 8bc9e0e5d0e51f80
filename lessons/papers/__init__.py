"""The papers' tables and figures: one package per paper with a tuple ITEMS, listed here."""

from lessons.papers import himpc_paper, htmpc_paper
from lessons.papers.item import Item

ITEMS: dict[str, Item] = {item.name: item for paper in (himpc_paper, htmpc_paper) for item in paper.ITEMS}
"""All items that can be reproduced, by name."""
