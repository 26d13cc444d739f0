"""Workers on several computers, by Dask: the one file that knows it, and loads it when a scheduler is named."""

import platform
from concurrent.futures import CancelledError, Future
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from cmmlink.archive.scheduling import Judge
from cmmlink.archive.tasks import Outcome, Task
from cmmlink.errors import PlanError
from cmmlink.record import FILE_NAME
from cmmlink.version import __version__
from drivers import LinkError

if TYPE_CHECKING:
    from distributed import Client

_AHEAD = 2  # tasks for each thread of a worker: the next one is there before it has to be asked for
PATIENCE_S = 10.0  # for the scheduler to answer


class Cluster:
    """The workers of a Dask scheduler. A task whose worker ended is given to another one by the scheduler itself, up to four times."""

    def __init__(self, address: str, patience_s: float = PATIENCE_S) -> None:
        """Raises PlanError where Dask is not installed or no worker can judge, LinkError where no scheduler answers."""
        self._address = address
        with ExitStack() as opened:
            self._client = opened.enter_context(_client(address, patience_s))
            from distributed import KilledWorker  # noqa: PLC0415 - loaded when it serves

            self.deaths: tuple[type[BaseException], ...] = (KilledWorker,)
            self._executor = opened.enter_context(self._client.get_executor(pure=False))
            self.places = _AHEAD * sum(self._client.nthreads().values())
            if not self.places:
                raise PlanError(f"{address}: the scheduler has no workers; start some with `dask worker {address} --nthreads 1`")
            self._opened = opened.pop_all()

    def __enter__(self) -> "Cluster":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self._opened.close()
        if isinstance(error, CancelledError):
            raise LinkError(f"{self._address}: the connection to the scheduler was lost; what was kept stays, run it again") from error

    def require_same(self, file: Path) -> None:
        """Raise PlanError where the workers have another cmmlink, or cannot read the records from their computers."""
        try:
            told = self._client.run(_told)
        except ImportError as error:
            expected = f"expected cmmlink {__version__} with every worker"
            raise PlanError(f"{self._address}: a worker cannot load cmmlink ({error}); {expected}") from None
        for worker, (version, _) in told.items():
            if version != __version__:
                raise PlanError(f"{self._address}: the worker {worker} has cmmlink {version}; expected {__version__}, as here")
        others = sorted({node for _, node in told.values()} - {platform.node()})
        if others and file.name == FILE_NAME:
            raise PlanError(
                f"{file}: workers on other computers ({', '.join(others)}) cannot read records that a station adds to; expected a backup "
                "of them in a folder that all reach (`cmmlink backup FILE`), and --records DIR for where the judgements are kept"
            )

    def submit(self, judge: Judge, task: Task) -> Future[list[Outcome]]:
        """Let a worker judge the runs of a task."""
        future: Future[list[Outcome]] = self._executor.submit(judge, task)
        return future


def _told() -> tuple[str, str]:
    """What a worker tells of itself: its version of cmmlink, and the name of its computer."""
    return __version__, platform.node()


def _client(address: str, patience_s: float) -> "Client":
    try:
        from distributed import Client  # noqa: PLC0415 - loaded when it serves
    except ImportError:
        raise PlanError("--scheduler needs Dask, which is not installed; install it with: pip install 'cmmlink[cluster]'") from None
    try:
        return Client(address, timeout=patience_s, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError) as error:
        raise LinkError(f"{address}: no scheduler of Dask answers there ({error}); expected an address like tcp://10.0.0.5:8786") from None
