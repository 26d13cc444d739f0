"""A job: its device, its end, and what aborts it."""

import threading

from cmmlink.console.job import Job

from .played import PlayedSource


def stopped(source: PlayedSource) -> bool:
    """Whether the source was told to stop: it ends at once instead of waiting for ever."""
    ended = threading.Event()

    def read() -> None:
        list(source.arrivals())
        ended.set()

    threading.Thread(target=read, daemon=True).start()
    return ended.wait(30.0)


def wait_for(event: threading.Event) -> None:
    assert event.wait(30.0)


def test_device_that_is_attached_after_the_abort_is_stopped_at_once() -> None:
    job, source = Job("run", lambda: None), PlayedSource()
    job.abort()
    job.attach(source)
    assert stopped(source)


def test_job_is_over_before_anybody_hears_of_its_end() -> None:
    heard: list[bool] = []
    released = threading.Event()
    job = Job("run", lambda: heard.append(job.over))
    job.start(lambda: wait_for(released))
    assert not job.over
    assert not job.wait(0.0)
    released.set()
    assert job.wait(30.0)
    assert heard == [True]


def test_scan_cannot_be_ended_where_nothing_is_measured() -> None:
    job = Job("device test", lambda: None)
    job.attach(PlayedSource())
    assert not job.end_scan(), "a test of the device is no scan"
    job.give_up()
    assert job.over
    assert not job.end_scan()
