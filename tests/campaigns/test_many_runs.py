"""Many runs on a real scheduler with two processes: each once, whatever is killed or fails."""

import collections
import concurrent.futures
import copy
import dataclasses
import json
import os
import re
import resource
import signal
import socket
import ssl
import subprocess
import sys
import urllib.error
import urllib.request

import dask
import many_tasks
import psutil
import pytest
from distributed import LocalCluster, Security
from listening import Address, listening

from geoimp_drake.campaigns import many_runs
from geoimp_drake.campaigns.journal import Finished, Journal
from geoimp_drake.campaigns.many_runs import run_many
from geoimp_drake.errors import ConfigurationError, MissingPackageError, OutputError

PLAN = {"experiment": "none", "seed": 1, "vary": {"x": [0.0, 1.0]}}


@pytest.fixture(scope="module")
def scheduler():
    """The address of a scheduler with two processes; a task may lose one process, not two."""
    settings = {
        "distributed.scheduler.allowed-failures": 1,
        "distributed.scheduler.worker-saturation": 1.0,
    }
    local = {
        "n_workers": 2,
        "threads_per_worker": 1,
        "host": "127.0.0.1",
        "dashboard_address": ":0",
    }
    with dask.config.set(settings), LocalCluster(**local, silence_logs="CRITICAL") as cluster:
        yield cluster.scheduler_address


@pytest.fixture
def journal(tmp_path):
    return tmp_path / "out" / "journal.jsonl"


def run(function, tasks, journal, scheduler, plan=PLAN):
    keyed = {f"task {index}": task for index, task in enumerate(tasks)}
    done = run_many(keyed, function, jobs=2, journal=journal, plan=plan, scheduler=scheduler)
    assert list(done) == list(keyed)
    return list(done.values())


def keys_in(journal) -> list[str]:
    return [json.loads(line)["key"] for line in journal.read_text().splitlines()[1:]]


def test_a_killed_process_loses_nothing_and_repeats_nothing(journal, scheduler, tmp_path):
    tasks = [(str(tmp_path), number) for number in range(20)]
    done = run(many_tasks.deadly_once, tasks, journal, scheduler)
    assert (tmp_path / "killed").exists()
    assert [finished.result for finished in done] == [number**2 for number in range(20)]
    assert collections.Counter(keys_in(journal)) == {f"task {n}": 1 for n in range(20)}


def test_a_task_that_kills_each_process_is_an_error_and_is_tried_again(journal, scheduler):
    done = run(many_tasks.deadly, range(4), journal, scheduler)
    assert [finished.result for finished in done] == [0, None, 4, 9]
    assert done[1].error == "The process that ran it was lost, 2 times."
    assert sorted(keys_in(journal)) == ["task 0", "task 2", "task 3"]
    again = run(many_tasks.square, range(4), journal, scheduler)
    assert again[1].result == 1


def test_a_task_that_raises_is_finished_with_its_error(journal, scheduler):
    done = run(many_tasks.failing, range(4), journal, scheduler)
    assert [finished.result for finished in done] == [0, None, None, 9]
    assert done[1].error == "ValueError: one is refused"
    assert done[2].error == "SystemExit: Drake gave up"
    assert Journal(journal, PLAN).read() == {f"task {n}": done[n] for n in range(4)}


def test_only_what_is_missing_is_run(journal, scheduler, tmp_path):
    tasks = [(str(tmp_path), number) for number in range(6)]
    run(many_tasks.noted, tasks[:4], journal, scheduler)
    with journal.open("ab") as file:
        file.write(b'{"key": "task 4", "res')  # as a killed process leaves it
    done = run(many_tasks.noted, tasks, journal, scheduler)
    assert [finished.result for finished in done] == [number**2 for number in range(6)]
    assert [(tmp_path / str(n)).read_text() for n in range(6)] == ["ran\n"] * 6
    assert sorted(keys_in(journal)) == [f"task {n}" for n in range(6)]


def test_nothing_is_started_when_nothing_is_missing(journal, scheduler):
    done = run(many_tasks.square, range(3), journal, scheduler)
    assert run(many_tasks.square, range(3), journal, "tcp://127.0.0.1:1") == done


def test_one_scheduler_keeps_equal_keys_of_different_runs_apart(tmp_path, scheduler):
    def one(name: str, numbers: range) -> list[int]:
        tasks = [(str(tmp_path), number) for number in numbers]
        done = run(many_tasks.noted, tasks, tmp_path / name / "journal", scheduler)
        return [finished.result for finished in done]

    with concurrent.futures.ThreadPoolExecutor() as threads:
        first, other = threads.map(one, ("a", "b"), (range(30), range(50, 80)))
    assert first == [number**2 for number in range(30)]
    assert other == [number**2 for number in range(50, 80)]


@pytest.fixture
def no_own_allocator(monkeypatch):
    monkeypatch.delenv("GLIBC_TUNABLES", raising=False)


@pytest.mark.usefixtures("no_own_allocator")
def test_own_processes_have_one_thread_are_silent_and_leave_interrupts_to_the_first(journal, capfd):
    done = [finished.result for finished in run(many_tasks.surroundings, range(8), journal, None)]
    assert len({result.pop("pid") for result in done}) == 2
    expected = {
        "threads": ["1"] * 3,
        "allocator": "glibc.malloc.tcache_count=1000:glibc.malloc.hugetlb=1",
        "profiled": False,
        "interruptible": False,
    }
    assert done == [expected] * 8
    assert capfd.readouterr().err == ""


def test_own_processes_end_after_their_share(journal, monkeypatch, capfd):
    """Drake frees nothing of a diagram with systems in Python before its process ends."""
    monkeypatch.setattr(many_runs, "_SHARE", 2)
    done = run(many_tasks.where, range(5), journal, None)
    assert [finished.result[0] for finished in done] == [number**2 for number in range(5)]
    processes = [finished.result[1] for finished in done]
    assert set(processes[:4]).isdisjoint(processes[4:])
    assert len(journal.read_text("utf-8").splitlines()) == 1 + 5
    assert capfd.readouterr().err == ""


@pytest.mark.usefixtures("no_own_allocator")
def test_what_own_processes_are_set_to_stays_with_them(journal):
    before = dict(os.environ)
    assert run(many_tasks.surroundings, range(1), journal, None)[0].result["allocator"]
    assert dict(os.environ) == before


def test_what_the_user_has_set_holds_in_own_processes(journal, monkeypatch):
    monkeypatch.setenv("GLIBC_TUNABLES", "glibc.malloc.tcache_count=20")
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    (done,) = run(many_tasks.surroundings, range(1), journal, None)
    assert done.result["allocator"] == "glibc.malloc.tcache_count=20"
    assert done.result["threads"] == ["2", "1", "1"]
    assert os.environ["GLIBC_TUNABLES"] == "glibc.malloc.tcache_count=20"


@pytest.fixture(scope="module")
def own():
    """A cluster as a sweep starts it, every address at which it listens, and its processes."""
    before = family()
    others = listening(before)
    with many_runs._local_cluster(2) as cluster:
        yield cluster, listening(family()) - others, family() - before


def family() -> set[int]:
    """The numbers of this process and of all that it has started."""
    this = psutil.Process()
    return {this.pid, *(child.pid for child in this.children(recursive=True))}


def is_answered(address: Address, context: ssl.SSLContext | None = None) -> bool:
    """Whether what listens at an address talks: Dask's parts begin as soon as one is let in."""
    try:
        with (
            socket.create_connection(address, timeout=0.5) as plain,
            context.wrap_socket(plain) if context else plain as connection,
        ):
            return connection.recv(1) != b""
    except OSError:  # a timeout is one, too
        return False


def own_keys(*, credulous: bool) -> ssl.SSLContext:
    """What a stranger connects with who has made keys and, if credulous, checks nobody's."""
    context = Security.temporary().get_connection_args("client")["ssl_context"]
    if credulous:
        context.verify_mode = ssl.CERT_NONE
    return context


def dask_ports(cluster) -> set[Address]:
    """Where the scheduler, each process and who minds it are spoken to."""
    minders = cluster.workers.values()
    spoken = [cluster.scheduler.address, *(m.address for m in minders)]
    spoken += [minder.worker_address for minder in minders]
    return {(host, int(port)) for host, port in (a.split("//")[1].split(":") for a in spoken)}


def test_own_processes_listen_on_loopback_only(own):
    _, addresses, _ = own
    assert len(addresses) == 8  # scheduler, two processes, two that mind them; three of HTTP
    assert {host for host, _ in addresses} == {"127.0.0.1"}


def test_own_processes_answer_to_their_own_keys(own):
    cluster, addresses, _ = own
    assert len(dask_ports(cluster)) == 5
    assert dask_ports(cluster) <= addresses
    keys = cluster.security.get_connection_args("client")["ssl_context"]
    assert all(is_answered(address, keys) for address in dask_ports(cluster))


@pytest.mark.parametrize(
    "keys",
    [None, own_keys(credulous=False), own_keys(credulous=True)],
    ids=["no keys", "keys of its own", "keys of its own and checks none"],
)
def test_no_part_of_own_processes_answers_a_stranger(own, keys):
    assert not any(is_answered(address, keys) for address in dask_ports(own[0]))


STRANGER = """
import sys
from distributed import Client, Security

address = sys.argv[1]
keys = Security.temporary() if address.startswith("tls:") else None
try:
    client = Client(address, timeout=1, security=keys)
except OSError:
    sys.exit("refused")
print(client.run(pow, 3, 2))
"""


@pytest.mark.parametrize("scheme", ["tcp", "tls"])
def test_a_stranger_is_no_client_of_own_processes(own, scheme):
    address = f"{scheme}://127.0.0.1:{own[0].scheduler.port}"
    command = (sys.executable, "-c", STRANGER, address)
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout == ""
    assert "refused" in done.stderr


@pytest.mark.parametrize("page", ["status", "info/main/workers.html", "health", "metrics"])
def test_own_processes_show_no_pages(own, page):
    cluster, addresses, _ = own
    for host, port in addresses - dask_ports(cluster):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(f"http://{host}:{port}/{page}", timeout=5)


def test_keys_of_own_processes_are_neither_their_arguments_nor_in_their_environment(own):
    cluster, _, processes = own
    secret = cluster.security.tls_worker_key.splitlines()[1]
    assert len(processes) >= 2
    for process in map(psutil.Process, processes):
        assert secret not in f"{process.cmdline()} {process.environ()}"


def test_a_scheduler_with_keys_takes_those_of_dasks_own_settings(journal, tmp_path):
    keys = Security.temporary()
    for name, content in (("cert", keys.tls_client_cert), ("key", keys.tls_client_key)):
        (tmp_path / f"{name}.pem").write_text(content)
    variables = {
        "DASK_DISTRIBUTED__COMM__TLS__CA_FILE": str(tmp_path / "cert.pem"),
        "DASK_DISTRIBUTED__COMM__TLS__CLIENT__CERT": str(tmp_path / "cert.pem"),
        "DASK_DISTRIBUTED__COMM__TLS__CLIENT__KEY": str(tmp_path / "key.pem"),
    }
    settings = copy.deepcopy(dask.config.config)
    local = {"n_workers": 1, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0"}
    with (
        LocalCluster(**local, host="127.0.0.1", security=keys, silence_logs="CRITICAL") as cluster,
        dask.config.set(dask.config.update(settings, dask.config.collect_env(variables))),
    ):
        done = run(many_tasks.square, range(2), journal, cluster.scheduler_address)
    assert [finished.result for finished in done] == [0, 1]


def test_a_scheduler_that_does_not_answer_is_refused_and_nothing_is_written(journal, monkeypatch):
    monkeypatch.setattr(many_runs, "_CONNECT_TIMEOUT", 0.5)
    with pytest.raises(ConfigurationError, match=r"tcp://127\.0\.0\.1:1 does not answer"):
        run(many_tasks.square, range(2), journal, "tcp://127.0.0.1:1")
    assert not journal.parent.exists()


def test_a_scheduler_without_processes_is_refused_and_nothing_is_written(journal, monkeypatch):
    monkeypatch.setattr(many_runs, "_WORKER_TIMEOUT", 0.2)
    with LocalCluster(n_workers=0, dashboard_address=":0", host="127.0.0.1") as empty:
        address = empty.scheduler_address
        with pytest.raises(ConfigurationError, match=f"{address} has no workers; start some"):
            run(many_tasks.square, range(2), journal, address)
    assert not journal.parent.exists()


@pytest.mark.parametrize("package", ["distributed", "cryptography"])
def test_a_missing_extra_is_named_and_nothing_is_written(journal, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingPackageError, match=f"needs the package {package}: "):
        run(many_tasks.square, range(2), journal, None)
    assert not journal.parent.exists()


def written(journal, plan=PLAN) -> None:
    with Journal(journal, plan) as book:
        book.add("task 0", Finished({"x": 0.1 + 0.2, "holds": None}, None, 1.0))


def test_a_journal_gives_back_what_was_put_in_to_the_last_bit(journal):
    written(journal)
    assert Journal(journal, PLAN).read() == {
        "task 0": Finished({"x": 0.1 + 0.2, "holds": None}, None, 1.0)
    }


@pytest.mark.parametrize(
    ("plan", "message"),
    [
        ({**PLAN, "seed": 2}, "seed is 1 there and 2 here"),
        ({**PLAN, "vary": {"x": [0.0, 2.0]}}, r"vary.x is \[0.0, 1.0\] there and \[0.0, 2.0\]"),
        ({**PLAN, "vary": {"y": [0.0, 1.0]}}, "vary.y is not given there"),
    ],
)
def test_a_journal_of_another_plan_is_refused_by_naming_what_differs(journal, plan, message):
    written(journal)
    before = journal.read_bytes()
    with pytest.raises(ConfigurationError, match=message):
        run(many_tasks.square, range(2), journal, None, plan)
    assert journal.read_bytes() == before


@pytest.mark.parametrize("content", ["text", "[]\n[]", "[1]", "\0" * 512, "[" * 10**5])
def test_a_file_that_is_no_journal_is_refused_and_left_alone(journal, content):
    journal.parent.mkdir()
    journal.write_text(f"{content}\n")
    with pytest.raises(ConfigurationError, match="is not a journal of runs"):
        Journal(journal, PLAN).read()
    assert journal.read_text() == f"{content}\n"


FIELDS = {"x": float, "holds": bool | None}
WHOLE = '{"key": "k", "result": {"x": 0.5, "holds": null}, "error": null, "wall_time": 1.0}'
DAMAGED = [
    "\0" * 4096,
    "\0" * 100 + WHOLE,
    "\r",
    "[]",
    '{"key": "a"}',
    WHOLE.replace('{"x": 0.5, "holds": null}', "5"),
    WHOLE.replace('{"x": 0.5, "holds": null}', "null"),
    WHOLE.replace("0.5", '"half"'),
    WHOLE.replace(', "holds": null', ""),
    WHOLE.replace('"k"', "[1]"),
    WHOLE.replace('"k"', '"\\ud800"'),
    WHOLE.replace("1.0", '"long"'),
    WHOLE.replace("1.0", "1" * 5000),
    WHOLE.replace('"error": null', '"error": 5'),
    WHOLE.replace("}}", '}, "more": 1}').replace(', "error"', ', "mistake"'),
    "[" * 10**5,
]


@pytest.mark.parametrize("line", DAMAGED, ids=range(len(DAMAGED)))
def test_a_damaged_line_is_skipped_and_said_and_the_others_count(journal, line, caplog):
    written(journal)
    with journal.open("a") as file:
        file.write(f"{line}\n{WHOLE}\n")
    read = Journal(journal, PLAN, FIELDS).read()
    assert list(read) == ["task 0", "k"]
    assert read["k"] == Finished({"x": 0.5, "holds": None}, None, 1.0)
    (said,) = caplog.messages
    assert re.search(r"1 damaged lines are skipped, the first of them line 3\.", said)
    with Journal(journal, PLAN, FIELDS) as book:  # nothing behind it is cut off
        book.add("after", read["k"])
    assert list(Journal(journal, PLAN, FIELDS).read()) == ["task 0", "k", "after"]


def test_a_task_whose_line_is_damaged_is_run_again(journal, scheduler, tmp_path, caplog):
    tasks = [(str(tmp_path), number) for number in range(4)]
    run(many_tasks.noted, tasks, journal, scheduler)
    lines = journal.read_bytes().splitlines(keepends=True)
    (lost,) = (k for k, line in enumerate(lines) if b"task 2" in line)
    lines[lost] = bytes(len(lines[lost]) - 1) + b"\n"
    journal.write_bytes(b"".join(lines))
    done = run(many_tasks.noted, tasks, journal, scheduler)
    assert [finished.result for finished in done] == [number**2 for number in range(4)]
    assert [len((tmp_path / str(n)).read_text()) // 4 for n in range(4)] == [1, 1, 2, 1]
    assert "1 damaged lines are skipped" in caplog.text


def test_an_error_that_the_machine_caused_is_tried_again(journal, scheduler, tmp_path):
    kinds = ["extra", "file", "disk", "memory", "input"]
    tasks = [(str(tmp_path), kind) for kind in kinds]
    first = run(many_tasks.lacking, tasks, journal, scheduler)
    assert [finished.error is None for finished in first] == [False] * 5
    assert "pip install" in first[0].error
    assert keys_in(journal) == ["task 4"]
    (tmp_path / "installed").touch()
    again = run(many_tasks.lacking, tasks, journal, scheduler)
    assert [finished.result for finished in again] == [*kinds[:4], None]
    assert again[4] == first[4]


def test_on_a_full_disk_what_ended_before_is_kept(journal, scheduler, monkeypatch):
    real = Journal.add

    def add(book, key, finished):
        if finished.result == 4:
            # Longer than what is left of a limit that the system keeps; its error is as a disk's.
            finished = dataclasses.replace(finished, result="x" * 10**5)
        real(book, key, finished)

    monkeypatch.setattr(Journal, "add", add)
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (10**4, limit[1]))
    try:
        kept = r"cannot be written: .*\. \d of 3 runs are kept; start the same again"
        with pytest.raises(OutputError, match=kept):
            run(many_tasks.square, range(3), journal, scheduler)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
        signal.signal(signal.SIGXFSZ, handler)
    monkeypatch.setattr(Journal, "add", real)
    kept = Journal(journal, PLAN).read()
    assert all(len(str(finished.result)) == 1 for finished in kept.values())
    done = run(many_tasks.square, range(3), journal, scheduler)
    assert [finished.result for finished in done] == [0, 1, 4]


def test_what_differs_is_said_in_one_short_line(journal):
    long = {"scenario": {f"key {k}": list(range(100)) for k in range(100)}, "\n" * 1000: 1}
    with Journal(journal, long):
        pass
    with pytest.raises(ConfigurationError) as raised:
        Journal(journal, PLAN).read()
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 600 + len(str(journal.parent))


def test_two_processes_do_not_write_one_journal(journal):
    with Journal(journal, PLAN), pytest.raises(ConfigurationError, match="Another process"):
        Journal(journal, PLAN).__enter__()


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").touch()
    with (
        pytest.raises(ConfigurationError, match=r"cannot be written: .*--out"),
        Journal(tmp_path / "file" / "journal", PLAN),
    ):
        pass
