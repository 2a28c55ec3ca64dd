"""Run jobs in joblib's worker processes: one that crashes, hangs or eats memory costs itself only.

Starting, feeding and ending processes is joblib's work (its loky backend here, its dask backend in
`compressor.cluster`). Ours is what it cannot know: how many jobs make a batch, which job was at
work in a process that died or took too long, and what runs again.
"""

import contextlib
import ctypes
import itertools
import multiprocessing
import operator
import os
import pickle
import queue
import resource
import signal
import struct
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Hashable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any, NamedTuple

from joblib import Parallel, cpu_count, delayed
from joblib.externals.loky import get_reusable_executor
from joblib.externals.loky.backend.process import LokyProcess
from joblib.externals.loky.process_executor import BrokenProcessPool
from joblib.parallel import LokyBackend

from compressor.reasons import Reason

Input = tuple[Hashable, Any, float]  # id, payload, wall time that the job may take (s)

TICK = 0.1  # s between two looks at the clocks of the jobs
TARGET = 0.2  # s that a batch should take
OVERRUN = 2.0  # targets after which a worker gives the rest of a batch back
STALL = 60.0  # s without any result, while no job runs, after which the workers are killed
UNSEEN = 3.0  # s that joblib may take to see that a worker died
MOST_BATCH = 200  # jobs
MOST_READY = 4  # batches that wait to be taken before workers wait, too
MEMORY = 50  # jobs that a mean of their seconds rests on
FRUITLESS = 10  # times in a row that workers may die without any job beginning or ending
MOST_TEXT = 20_000  # characters of a traceback
AGAIN = "also when it ran again alone"
MEMORY_SHARE = 0.75  # of the machine's memory, for all workers together
MEMORY_LIMITS = ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes")
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
PR_SET_PDEATHSIG = 1  # linux/prctl.h
NOTE = struct.Struct("ddd")  # process, job of the batch, since when; see Local.note
NONE_YET = -1.0  # in place of a job


class WorkersFailed(Exception):
    """Worker processes cannot be started, or die before they begin a job."""


@dataclass(frozen=True)
class Done:
    """A job that ended, its result, and the seconds that it took."""

    id: Any
    result: Any
    seconds: float


@dataclass(frozen=True)
class Lost:
    """A job that has no result.

    `reason`: WORKER_DIED, OUT_OF_MEMORY, BUDGET_SECONDS, or INTERNAL_ERROR, with a traceback,
    where the work raised an exception.
    """

    id: Any
    reason: str
    detail: str
    traceback: str = ""


@dataclass(frozen=True)
class Workers:
    """Worker processes: how many, and the rules for them.

    `prepare` is called once in each, before its clocks and limits are set. `memory`: bytes that a
    job may add (by default `memory_share`). `grace`: s beyond its time in which a job may end by
    itself.
    """

    count: int = 2
    prepare: Callable[[], object] = int
    memory: int | None = None
    grace: float = 1.0
    target_seconds: float = TARGET


class Job(NamedTuple):
    """A job that is not finished."""

    id: Any
    payload: bytes
    timeout: float
    retried: bool = False  # it is tried alone, since it may have been why a worker died


def run_batches(
    work: Callable[[Any], Any],
    jobs: Iterable[Input],
    workers: Workers,
    total: int | None = None,
    pulse: Callable[[], object] = lambda: None,
) -> Generator[Done | Lost, None, None]:
    """Call work(payload) for each job in worker processes; yield how each one ended.

    `jobs` is read as workers need it, in a thread; `total` (by default its length hint) lets
    batches shrink towards the end. What `work` raises makes its job Lost. `pulse` is called several
    times a second, whether or not jobs end.

    Closing the iterator kills the workers. Whatever is raised here, a signal's exception too, comes
    after the results that had arrived (`rest` does the same for what the caller raises). Raises
    WorkersFailed, and what `jobs` raises.
    """
    left = operator.length_hint(jobs, 0) if total is None else total
    return Local(work, jobs, workers, left).ends(pulse)


def rest(ends: Generator[Done | Lost, None, None], error: BaseException) -> Iterator[Done | Lost]:
    """After an error in the loop over `run_batches`: what had arrived by then, then the error.

    The workers end at once.
    """
    with contextlib.suppress(StopIteration):
        yield ends.throw(error)
        yield from ends


class Batches:
    """Jobs that are not finished, in batches as joblib takes them: the same for all its backends.

    joblib waits in a thread of its own, since it can do nothing else meanwhile, and an exception
    of a signal must not hit it. A backend says how it starts, watches and ends (`Local`).
    """

    parallel: Callable[[], Parallel]  # joblib's, for one round: called in the thread
    call: Callable[[list[Job]], Any]  # a batch as joblib takes it
    watch: Callable[[float, bool], None]  # the time (s), and whether something has arrived
    fail: Callable[[BaseException], Iterable[Lost]]  # a round ended by an error
    stop: Callable[[], None]  # ends all workers; what had arrived stays

    def __init__(self, jobs: Iterable[Input], left: int, target_seconds: float, width: int):
        self.source, self.left, self.counted = iter(jobs), left, left > 0
        self.target_seconds, self.width = target_seconds, width  # width: batches at work at once
        self.waiting: deque[Job] = deque()  # jobs to be done again
        self.suspects: deque[list[Job]] = deque()  # batches to be tried alone
        self.out: dict[int, list[Job]] = {}  # batches that joblib has, by their number
        self.arrived: queue.SimpleQueue[Any] = (
            queue.SimpleQueue()
        )  # None: joblib has come to an end
        self.mean, self.weight = 0.0, 0  # seconds a job; how many jobs that rests on
        self.most = MOST_BATCH
        self.stopped = False
        self.alone = False  # whether a suspect is tried
        self.round: Future[None] | None = None
        self.thread = ThreadPoolExecutor(1)

    def ends(self, pulse: Callable[[], object]) -> Generator[Done | Lost, None, None]:
        """How each job ended; workers end with the iterator."""
        try:
            yield from self.done(pulse)
        except GeneratorExit:
            raise
        except BaseException:
            self.stop()
            while not self.arrived.empty():
                if item := self.arrived.get():
                    yield from self.finish(*item)
            raise
        finally:
            self.stop()

    def done(self, pulse: Callable[[], object]) -> Iterator[Done | Lost]:
        """How each job ended; workers stay."""
        while self.round or self.begin() or not self.arrived.empty():
            item: Any = ()
            with contextlib.suppress(queue.Empty):
                item = self.arrived.get(timeout=TICK)
            self.watch(time.monotonic(), bool(item))
            if item is None:
                yield from self.over()
            elif item:
                yield from self.finish(*item)
            pulse()

    def begin(self) -> bool:
        """Have joblib do what there is, or one suspect alone; False where all jobs are done."""
        batch = self.next_batch()
        self.alone = not batch and bool(self.suspects)
        if self.alone:
            self.discard()
            batches: Iterable[list[Job]] = [self.suspects.popleft()]
        else:
            batches = itertools.chain([batch], iter(self.next_batch, []))
        if batch or self.alone:
            self.round = self.thread.submit(self.run, batches)
        return self.round is not None

    def run(self, batches: Iterable[list[Job]]) -> None:
        """Have joblib do batches: in the thread. What they give arrives by `hand_over`."""
        try:
            for _ in self.parallel()(map(self.call, batches)):
                pass
        finally:
            self.arrived.put(None)

    def over(self) -> Iterator[Done | Lost]:
        """joblib has come to an end: what is lost by it, if it was no good one."""
        assert self.round
        error, self.round = self.round.exception(), None
        if error:
            yield from self.fail(error)

    def hand_over(self, number: int, found: Any) -> None:
        """A batch has ended: in joblib's thread."""
        self.arrived.put((self.out.pop(number), found))

    def next_batch(self) -> list[Job]:
        """Jobs for about `target_seconds`: few at first, and towards the end; none: that is all."""
        size = 1.0
        if self.weight:
            size = self.target_seconds / max(self.mean, 1e-9)
            if self.counted:
                size = min(size, (self.left + len(self.waiting)) / (2 * self.width))
        batch: list[Job] = []
        if self.stopped or self.arrived.qsize() > MOST_READY * self.width:
            return batch
        while len(batch) < min(size, self.most):
            job = self.waiting.popleft() if self.waiting else self.issue()
            if job is None:
                break
            batch.append(job)
        return batch

    def issue(self) -> Job | None:
        """The next job of the source, None at its end."""
        for name, payload, timeout in self.source:
            self.left = max(self.left - 1, 0)
            try:
                return Job(name, pickle.dumps(payload, pickle.HIGHEST_PROTOCOL), timeout)
            except Exception as error:
                lost = Lost(None, Reason.INTERNAL_ERROR, *described(error))
                self.arrived.put(([Job(name, b"", timeout)], [lost]))
        return None

    def finish(self, batch: list[Job], found: list[Done | Lost]) -> Iterator[Done | Lost]:
        """How the jobs of a batch ended; a rest that was given back waits again."""
        self.waiting.extendleft(reversed(batch[len(found) :]))
        for job, end in zip(batch, found, strict=False):
            if isinstance(end, Lost):
                again = end.reason == Reason.OUT_OF_MEMORY
                yield from self.lose(job, end, again)
                continue
            self.learn(end.seconds)
            try:
                end = replace(end, id=job.id, result=pickle.loads(end.result))
            except Exception as error:
                end = Lost(job.id, Reason.INTERNAL_ERROR, *described(error))
            yield end

    def learn(self, seconds: float) -> None:
        """Take note of what a job took."""
        known = min(self.weight, MEMORY)
        self.mean, self.weight = (known * self.mean + seconds) / (known + 1), known + 1

    def lose(self, job: Job, end: Lost, again: bool) -> Iterator[Lost]:
        """A job is lost, or tried again, once and alone."""
        if again and not job.retried:
            self.suspects.append([job._replace(retried=True)])
        else:
            detail = f"{end.detail}, {AGAIN}" if again else end.detail
            yield replace(end, id=job.id, detail=detail)

    def discard(self) -> None:
        """End what a suspect must not share with others."""


class Loky(LokyBackend):
    """joblib's loky backend, which tells of a batch at once, in its thread.

    What waits in joblib's generator would be lost, and run again, when a worker dies.
    """

    def __init__(self, hand_over: Callable[[int, Any], None]):
        super().__init__(inner_max_num_threads=1)
        self.hand_over = hand_over

    def retrieve_result_callback(self, out: Any) -> list[None]:
        (found,) = super().retrieve_result_callback(out)
        self.hand_over(*found)
        return [None]

    def abort_everything(self, ensure_ready: bool = True) -> None:
        super().abort_everything(ensure_ready=False)  # joblib would start another without limits


class Local(Batches):
    """Jobs in processes of this machine, on a pool that ends with any of its processes.

    A note in shared memory tells of every batch which process is at which of its jobs, and since
    when. Nothing else names the job in which a process died, hung in compiled code or stood still:
    joblib knows batches alone, and fails all of them at once.
    """

    def __init__(
        self, work: Callable[[Any], Any], jobs: Iterable[Input], rules: Workers, left: int
    ):
        super().__init__(jobs, left, rules.target_seconds, rules.count)
        self.work, self.rules = work, rules
        self.memory = rules.memory or memory_share(rules.count)
        self.places = 4 * max(rules.count, 2)  # for notes: more than joblib asks for
        self.free = deque(range(self.places))
        # what a SIGKILL of ours leaves in shared memory is removed in silence
        os.environ.setdefault("PYTHONWARNINGS", "ignore:resource_tracker")
        self.shared = SharedMemory(create=True, size=self.places * NOTE.size)
        self.notes: Any = self.shared.buf
        self.pool: Parallel | None = None
        self.executor: Any = None
        self.processes: dict[int, Any] = {}
        self.late: set[int] = set()  # processes that were killed for taking too long
        self.heard = 0.0  # when a batch last ended, or was handed out
        self.fruitless = 0

    def parallel(self) -> Parallel:
        """The pool; a new one after a death, and for a suspect: in the thread.

        joblib would do a single job at a time in this process: it is told of two, loky of one.
        """
        signal.pthread_sigmask(signal.SIG_BLOCK, ENDING)  # of workers, too, until they ignore them
        if self.pool is None:
            initargs = (self.work, self.rules, self.memory, self.shared, os.getpid())
            self.pool = Parallel(
                max(self.width, 2), Loky(self.hand_over), "generator_unordered", batch_size=1,
                pre_dispatch=2 * self.width, max_nbytes=None, initializer=settle, initargs=initargs,
            ).__enter__()  # fmt: skip
            self.executor = get_reusable_executor(1 if self.alone else self.width, reuse=True)
        return self.pool

    def call(self, batch: list[Job]) -> Any:
        """A batch as joblib takes it."""
        place = self.free.popleft()
        NOTE.pack_into(self.notes, place * NOTE.size, 0, NONE_YET, 0)
        self.out[place], self.heard = batch, time.monotonic()
        return delayed(do_batch)(place, [job.payload for job in batch])

    def hand_over(self, number: int, found: Any) -> None:
        super().hand_over(number, found)
        self.free.append(number)

    def note(self, place: int) -> tuple[int, int, float]:
        """Process and job of a batch; since when the job runs, negative: until when it did; 0."""
        pid, position, since = NOTE.unpack_from(self.notes, place * NOTE.size)
        return int(pid), int(position), since

    def finish(self, batch: list[Job], found: list[Done | Lost]) -> Iterator[Done | Lost]:
        self.most, self.fruitless = MOST_BATCH, 0
        yield from super().finish(batch, found)

    def watch(self, now: float, news: bool) -> None:
        """Kill workers whose jobs take too long, and all of them where nothing moves any more."""
        self.processes |= {child.pid: child for child in children()}
        self.heard = now if news else self.heard
        latest, at_work = self.heard, False
        for place, batch in list(self.out.items()):
            pid, position, since = self.note(place)
            latest, at_work = max(latest, abs(since)), at_work or since > 0
            if since > 0 and now - since > batch[position].timeout + self.rules.grace:
                self.late.add(pid)
                kill([pid])
        dead = any(child.exitcode for child in self.processes.values())
        if self.round and now - latest > (UNSEEN if dead else STALL) and (dead or not at_work):
            self.break_up()

    def break_up(self) -> None:
        """Kill all workers, and have joblib see it.

        One that died amid a message leaves joblib reading the rest of it for ever, since this
        process, too, could write there: loky keeps that end open.
        """
        kill(self.processes)
        results = getattr(self.executor, "_result_queue", None)
        if results and not children():
            results._writer.close()

    def fail(self, error: BaseException) -> Iterator[Lost]:
        """The pool has broken: see to its jobs. The one that ran in a dead process may be why."""
        if isinstance(error, OSError) and not self.processes:
            raise WorkersFailed(f"no worker process can be started: {error}") from error
        if not isinstance(error, BrokenProcessPool):
            raise error
        codes = {pid: child.exitcode for pid, child in self.processes.items()}
        notes = {place: self.note(place) for place in self.out}
        running = {place: pid for place, (pid, _, since) in notes.items() if since > 0}
        named = [p for p, pid in running.items() if pid in self.late or died(codes.get(pid))]
        for place, batch in self.out.items():
            if place in (named or running):
                pid, position, _ = notes[place]
                yield from self.blame(batch.pop(position), pid in self.late, codes.get(pid))
            if batch and self.alone:
                self.suspects.append(batch)
            else:
                self.waiting.extendleft(reversed(batch))
        if not running:
            self.fruitless += 1
            self.most = max(1, max(map(len, self.out.values()), default=1) // 2)
            if self.fruitless > FRUITLESS:
                how = ending(next(filter(died, codes.values()), None))
                raise WorkersFailed(f"jobs could not even begin: {how}")
        self.discard()

    def blame(self, job: Job, late: bool, code: int | None) -> Iterator[Lost]:
        """A job was at work in a process that died, or was killed since it took too long."""
        text = f"more than {job.timeout:g} s of wall time; its worker was killed"
        reason = Reason.BUDGET_SECONDS
        if not late:
            reason, text = Reason.WORKER_DIED, f"its worker ended by {ending(code)}"
        yield from self.lose(job, Lost(None, reason, text), not late)

    def discard(self) -> None:
        """End the pool, if there is one."""
        if self.executor:
            self.executor.terminate(kill_workers=True)
        self.pool = self.executor = None
        self.processes, self.late = {}, set()
        self.out, self.free = {}, deque(range(self.places))

    def stop(self) -> None:
        """End all workers; what had arrived stays."""
        self.stopped = True
        while self.round and not self.round.done():
            self.processes |= {child.pid: child for child in children()}
            self.break_up()
            wait([self.round], TICK)
        self.thread.shutdown()
        self.discard()
        if self.notes:
            self.notes = None
            self.shared.close()
            self.shared.unlink()


def children() -> list[Any]:
    """The processes that loky has started and that run."""
    return [c for c in multiprocessing.active_children() if isinstance(c, LokyProcess)]


def kill(pids: Iterable[int]) -> None:
    """SIGKILL."""
    for pid in pids:
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)


def died(code: int | None) -> bool:
    """Whether a process ended by itself: those beside it are killed by loky."""
    return code not in (None, -signal.SIGKILL)


def ending(code: int | None) -> str:
    """How a process ended, from its exit code (less the signal's number)."""
    if code is None:
        return "an unknown cause"
    if code >= 0:
        return f"exit code {code}"
    if code == -signal.SIGKILL:
        return "SIGKILL: out of memory, or killed from outside"
    return signal.Signals(-code).name


# ---- in a worker --------------------------------------------------------------------------------

HERE: dict[str, Any] = {}  # what `settle` leaves for `do_batch`


def settle(
    work: Callable[[Any], Any], rules: Workers, memory: int, notes: SharedMemory, parent: int
) -> None:
    """Make a new process a worker: its end, signals, streams, memory; what it is told once."""
    end_with(parent)
    for number in (signal.SIGINT, signal.SIGHUP):  # Ctrl-C reaches all: the parent ends us
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, ENDING)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    with contextlib.suppress(OSError):  # there may be no stderr
        os.dup2(2, 1)  # stdout is for data
    os.environ["PYTHONFAULTHANDLER"] = ""  # or loky has a crash print where it was
    rules.prepare()
    HERE.update(work=work, target=rules.target_seconds, memory=memory)
    HERE.update(shared=notes, notes=notes.buf)
    limit(memory)


def end_with(parent: int) -> None:
    """Die when the parent does, even by SIGKILL and amid compiled code.

    Where there is no such call (Linux has it), a worker ends when it next needs the parent.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it died before
        os._exit(0)


def limit(memory: int) -> None:
    """Have allocations fail once a job has added `memory` bytes, and no crash write a core file."""
    _, most = resource.getrlimit(resource.RLIMIT_CORE)
    resource.setrlimit(resource.RLIMIT_CORE, (0, most))
    if sys.platform != "linux":
        return
    with open("/proc/self/oom_score_adj", "w") as file:
        file.write("500")  # should memory run out, a worker is a better victim than its parent
    with open("/proc/self/statm") as file:
        present = int(file.read().split()[5]) * resource.getpagesize()
    _, most = resource.getrlimit(resource.RLIMIT_DATA)
    wanted = present + memory
    if most == resource.RLIM_INFINITY or wanted < most:
        resource.setrlimit(resource.RLIMIT_DATA, (wanted, most))


def do_batch(place: int, payloads: Sequence[bytes]) -> tuple[int, list[Done | Lost]]:
    """Do the jobs of a batch: its place, and how jobs ended, all but a rest that is given back."""
    found: list[Done | Lost] = []
    began = start = time.monotonic()
    for position, payload in enumerate(payloads):
        NOTE.pack_into(HERE["notes"], place * NOTE.size, os.getpid(), position, start)
        found.append(perform(payload, start))
        start = time.monotonic()
        NOTE.pack_into(HERE["notes"], place * NOTE.size, os.getpid(), position, -start)
        if start - began > OVERRUN * HERE["target"]:
            break
    return place, found


def perform(payload: bytes, start: float) -> Done | Lost:
    """Do one job; its result is pickled."""
    try:
        result = pickle.dumps(HERE["work"](pickle.loads(payload)), pickle.HIGHEST_PROTOCOL)
        return Done(None, result, time.monotonic() - start)
    except MemoryError:
        most = f"needs more than the {HERE['memory'] / 1e9:.3g} GB that a worker may add"
        return Lost(None, Reason.OUT_OF_MEMORY, most)
    except BaseException as error:  # work may even call sys.exit
        return Lost(None, Reason.INTERNAL_ERROR, *described(error))


def described(error: BaseException) -> tuple[str, str]:
    """An exception in a line, and its traceback."""
    what = traceback.format_exception_only(error)[-1].strip()
    return what[:MOST_TEXT], "".join(traceback.format_exception(error))[-MOST_TEXT:]


# ---- the machine --------------------------------------------------------------------------------


def cores() -> int:
    """How many cores this process may use, by its affinity and its container's quota."""
    return cpu_count()


def memory_share(count: int) -> int:
    """Bytes for each of `count` workers: three quarters of the machine's, or the container's."""
    most = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    for path in MEMORY_LIMITS:
        with contextlib.suppress(OSError, ValueError):  # absent, or "max"
            most = min(most, int(Path(path).read_text()))
    return int(MEMORY_SHARE * most / count)
