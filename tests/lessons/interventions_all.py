"""The rows of all files of interventions."""

from __future__ import annotations

from interventions_documents import DOCUMENT_ROWS
from interventions_fifth_reader import FIFTH_ROWS
from interventions_fourth_reader import FOURTH_ROWS
from interventions_limits import LIMIT_ROWS
from interventions_mobile import MOBILE_ROWS
from interventions_reader import READER_ROWS
from interventions_seventh_reader import SEVENTH_ROWS
from interventions_sixth_reader import SIXTH_ROWS
from interventions_tasks import TASK_ROWS

ROWS = (
    *TASK_ROWS,
    *LIMIT_ROWS,
    *MOBILE_ROWS,
    *DOCUMENT_ROWS,
    *READER_ROWS,
    *FOURTH_ROWS,
    *FIFTH_ROWS,
    *SIXTH_ROWS,
    *SEVENTH_ROWS,
)
