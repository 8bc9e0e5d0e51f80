"""Questions to a simulation. The answers arrive in the order of the questions."""

from __future__ import annotations

from collections import deque
from queue import Queue
from threading import Lock
from typing import final

from app.link.messages import Tell, Told
from app.link.process import Process


@final
class Questions:
    """The questions that a process has not answered yet."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._waiting: deque[Queue[Told | None]] = deque()

    def ask(self, process: Process) -> Queue[Told | None] | None:
        """Requests the run so far. Returns the queue that will get the answer; None if the process has
        ended."""
        answer: Queue[Told | None] = Queue()
        with self._lock:
            if not process.send(Tell()):
                return None
            self._waiting.append(answer)
        return answer

    def answer(self, told: Told) -> None:
        """Passes an answer to the oldest question."""
        with self._lock:
            if self._waiting:
                self._waiting.popleft().put(told)

    def forget(self) -> None:
        """Ends all questions without an answer; called when the process has ended."""
        with self._lock:
            while self._waiting:
                self._waiting.popleft().put(None)
