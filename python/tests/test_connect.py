"""Devices: a native one through the command, and a command that a test simulates."""

import contextlib
import itertools
import os
import re
import runpy
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import hapterra
from hapterra import DeviceError, NotDisarmedError, Surface, Terrain, connect
from hapterra._session import Buffer, Session, _end_all

posix = pytest.mark.skipif(os.name != "posix", reason="signals and scripts of POSIX")
#: Less than the duration of the virtual hand's tour, s.
TOUR_S = 9.0
STAIRCASE = Path(__file__).parent.parent / "examples" / "friction_jnd.py"


def hills():
    y, x = np.mgrid[0:121.0, 0:141.0]
    return Terrain(4 * np.sin(x / 15) * np.cos(y / 20), cell_mm=0.7, origin="lower")


def rows_of(recording):
    """Returns the rows of a CSV recording by column."""
    lines = [line for line in recording.read_text("utf-8").splitlines() if line[:1] != "#"]
    rows = [line.split(",") for line in lines[1:]]
    return {name: [row[at] for row in rows] for at, name in enumerate(lines[0].split(","))}


def test_native_device_from_arming_to_disarmed(tmp_path):
    record = tmp_path / "felt.csv"
    with connect("native", record=record) as device:
        assert not device.is_armed and not device.is_disarmed
        device.load(hills(), Surface(friction=0.3, stiffness=0.4), duration="60s")
        device.arm()
        assert device.is_armed and device.fault is None
        with pytest.raises(DeviceError, match="disarm"):
            device.load(hills())
        device.params.friction = 0.2
        device.params.static_friction = 0.35
        device.params.stiffness = 0.6
        device.params.texture = ("grain", 0.1, 1.5)
        device.params.shading = "smooth"
        with pytest.raises(DeviceError, match="a friction of 20"):
            device.params.friction = 20
        with pytest.raises(DeviceError, match="a stiffness of 7.0"):
            device.params.stiffness = 7
        with pytest.raises(DeviceError, match="no such word"):
            device.command("zom 2")
        with pytest.raises(AttributeError, match="fricton"):
            device.params.fricton = 0.2
        assert "friction=0.2, static_friction=0.35" in repr(device.params)
        mark = device.mark("trial 3")
        with pytest.raises(ValueError):
            device.mark("a\nzoom 2")
        assert abs(mark.host_unix_s - time.time()) < 60
        samples = []
        for sample in device.samples():
            samples.append(sample)
            if sample.t_s > mark.t_s + 0.5:
                break
        kinds = {event["event"] for event, _ in zip(device.events(), range(6))}
        assert {"hello", "view", "limits"} <= kinds
    assert device.is_disarmed and not device.is_armed
    ticks = [sample.tick for sample in samples]
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks))) and device.dropped == 0
    rows, text = rows_of(record), record.read_text("utf-8")
    assert f'tick = {mark.tick}' in text and 'text = "trial 3"' in text
    views = re.findall(r"static_mu = ([\d.]+)\n# dynamic_mu = ([\d.]+)", text)
    assert views[:3] == [("0.3", "0.3"), ("0.2", "0.2"), ("0.35", "0.2")], views
    row_of = {int(tick): at for at, tick in enumerate(rows["tick"])}
    for sample in samples[::97]:
        at = row_of[sample.tick]
        hip = [float(rows[name][at]) for name in ("x_mm", "y_mm", "z_mm")]
        force = [float(rows[f"force_{axis}_n"][at]) for axis in "xyz"]
        assert sample.hip_mm == tuple(hip) and sample.force_n == tuple(force)
        assert (sample.state, sample.view) == (rows["state"][at], int(rows["view"][at]))


def test_array_is_loaded_in_its_orientation(tmp_path):
    heights = np.arange(12.0).reshape(3, 4)
    heights[0, 0] = np.nan
    path, scale = Terrain(heights, cell_mm=2, origin="lower")._write(tmp_path / "a.npy")
    assert np.array_equal(np.load(path), heights[::-1], equal_nan=True)
    assert scale == {"scale": "2.0mm/cell", "exaggeration": "1.0mm/unit"}
    opened = Terrain.open(path, cell_mm=2)
    again, _ = opened._write(tmp_path / "b.npy")
    assert np.array_equal(np.load(again), heights[::-1], equal_nan=True)
    with connect("native") as device:
        with pytest.raises(ValueError, match="materials of a Terrain"):
            device.load(Terrain(heights, cell_mm=2, materials=np.zeros((3, 4), int)))
        with pytest.raises(ValueError, match="materials of a surface"):
            device.load(hills(), Surface(materials=[Surface()]))


def test_exception_leaves_the_arm_disarmed(tmp_path):
    with pytest.raises(ZeroDivisionError):
        with connect("native", record=tmp_path / "felt.csv", sample_every=20) as device:
            device.load(hills())
            device.arm()
            1 / 0
    assert device.is_disarmed and (tmp_path / "felt.csv").exists()


def test_failed_open_raises_the_commands_error(tmp_path):
    with connect("native") as device:
        with pytest.raises(DeviceError, match="load"):
            device.arm()
        device.load(tmp_path / "nothing.tif")
        with pytest.raises(DeviceError, match="nothing.tif") as failed:
            device.arm()
        assert failed.value.hint
        device.load(hills(), fricton=1)
        with pytest.raises(DeviceError, match="unexpected argument '--fricton'"):
            device.arm()
    with pytest.raises(ValueError, match="is no device"):
        connect("serial")


def test_emulated_board_without_image_suggests_a_command(monkeypatch):
    monkeypatch.delenv("HAPTERRA_MPS2_ELF", raising=False)
    with connect("emulated") as device:
        device.load(hills())
        with pytest.raises(DeviceError, match="image") as failed:
            device.arm()
        assert "cargo xtask" in failed.value.hint


@pytest.mark.skipif(
    not os.environ.get("HAPTERRA_MPS2_ELF"), reason="HAPTERRA_MPS2_ELF names no emulated board"
)
def test_emulated_device_from_arming_to_disarmed(tmp_path):
    with connect("emulated", record=tmp_path / "felt.csv", sample_every=10) as device:
        device.load(hills(), Surface(friction=0.3))
        device.arm(timeout=600)
        device.params.friction = 0.2
        mark = device.mark("here")
        assert next(device.samples()).t_s >= 0
    assert device.is_disarmed
    assert f"tick = {mark.tick}" in (tmp_path / "felt.csv").read_text("utf-8")


def test_buffer_keeps_the_newest_and_counts():
    buffer = Buffer(3)
    for number in range(10):
        buffer.put(number)
    buffer.close()
    assert list(buffer) == [7, 8, 9] and buffer.dropped == 7


def interrupt_at(step):
    """Returns a trace function that raises KeyboardInterrupt at a numbered step of the package or
    of the standard library's threads, as Ctrl-C may."""
    steps = itertools.count()

    def trace(frame, event, _):
        if not frame.f_code.co_filename.endswith(("_session.py", "threading.py")):
            return None
        frame.f_trace_opcodes = True
        if event == "opcode" and next(steps) == step:
            raise KeyboardInterrupt
        return trace

    return trace


def interrupted_read(buffer, step):
    """Reads in this thread until Ctrl-C at a numbered step. Returns True if that step exists."""
    sys.settrace(interrupt_at(step))
    try:
        for _ in buffer:
            pass
    except KeyboardInterrupt:
        return True
    finally:
        sys.settrace(None)
    return False


def test_ctrl_c_at_any_step_of_a_reader_blocks_no_writer():
    for step in itertools.count():
        buffer = Buffer(3)
        buffer.put(0)
        threading.Timer(0.05, buffer.close).start()
        was_interrupted = interrupted_read(buffer, step)
        writer = threading.Thread(target=buffer.put, args=(1,), daemon=True)
        writer.start()
        writer.join(10)
        assert not writer.is_alive(), f"step {step}"
        if not was_interrupted:
            break
    assert step > 10


def test_ctrl_c_at_any_step_of_a_wait_blocks_no_event():
    session = fake_session(code="input()")
    event = {"event": "refused", "text": "no"}
    for step in range(60):
        sys.settrace(interrupt_at(step))
        with contextlib.suppress(KeyboardInterrupt):
            session.wait(lambda: False, 0.1)
        sys.settrace(None)
        reader = threading.Thread(target=session._handle_event, args=(event,), daemon=True)
        reader.start()
        reader.join(10)
        assert not reader.is_alive(), f"step {step}"
    session.close_input()


# Python processes that are killed.

SCRIPT = """
import os, sys, time, hapterra, numpy as np
if __name__ == "__main__":
    sys.path.insert(0, {tests!r})
    from test_connect import hills
    with hapterra.connect("native", record="felt.csv") as device:
        device.load(hills())
        device.arm()
        if {fork} and os.fork() == 0:
            time.sleep(600)
        try:
            print("armed", flush=True)
            for sample in device.samples():
                pass
        except KeyboardInterrupt:
            print("interrupted", flush=True)
            device.disarm()
            print("disarmed", device.is_disarmed, flush=True)
"""


def script(folder, fork=False):
    """Starts a Python that serves a native device, armed, in a process group of its own."""
    text = textwrap.dedent(SCRIPT).format(tests=str(Path(__file__).parent), fork=fork)
    words = [sys.executable, "-c", text]
    child = subprocess.Popen(
        words, cwd=folder, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert child.stdout.readline() == "armed\n"
    return child


def ends_early(record):
    """Waits until the recording of a session is complete that ended before the end of its tour."""
    until = time.monotonic() + 120
    while not record.exists():
        assert time.monotonic() < until, "the session continues"
        time.sleep(0.05)
    rows = rows_of(record)
    assert rows["mode"][-1] == "armed" and float(rows["t_s"][-1]) < TOUR_S


@posix
@pytest.mark.parametrize("fork", [False, True], ids=["alone", "with a fork"])
def test_killed_python_leaves_the_arm_disarmed(tmp_path, fork):
    child = script(tmp_path, fork)
    try:
        child.kill()
        ends_early(tmp_path / "felt.csv")
    finally:
        os.killpg(child.pid, signal.SIGKILL)
        child.wait()


@posix
def test_ctrl_c_leaves_the_arm_disarmed(tmp_path):
    child = script(tmp_path)
    # As a terminal sends it: to all processes of the group.
    os.killpg(child.pid, signal.SIGINT)
    result, _ = child.communicate(timeout=120)
    assert result == "interrupted\ndisarmed True\n" and child.returncode == 0
    ends_early(tmp_path / "felt.csv")


# A simulated command.

PLAYED = """\
#!{python}
import json, select, socket, sys
server = socket.create_server(("127.0.0.1", 0))
print("events         127.0.0.1:%d" % server.getsockname()[1], file=sys.stderr, flush=True)
reader = server.accept()[0].makefile("w")
def tell(event, **fields):
    line = dict(event=event, device=1, tick=7, t_s=0.007, **fields)
    print(json.dumps(line), file=reader, flush=True)
def mode(name):
    tell("limits", limits=[], mode=name, fault=None)
tell("view", view=0)
{play}
"""


@pytest.fixture
def played(tmp_path, monkeypatch):
    """Replaces the command by a script that simulates it."""

    def play(text):
        path = tmp_path / "hapterra"
        path.write_text(PLAYED.format(python=sys.executable, play=textwrap.dedent(text)))
        path.chmod(0o755)
        monkeypatch.setenv("HAPTERRA", str(path))

    return play


ASKS = """
lines = ["put the arm into its zero pose, hold it there and press Enter"]
tell("arming", lines=lines, asks=41)
answer = sys.stdin.readline()
tell("arming", lines=lines, asks=41)
# Another answer would come in this time.
select.select([sys.stdin], [], [], 1)
if answer == "enter 41\\n":
    tell("arming", lines=["  DEAD_MAN_RELEASED: press it"], asks=None)
    mode("armed")
sys.stdin.read()
tell("end", disarmed=True)
"""


@posix
def test_question_of_a_real_arm_is_asked_once_and_answered(played):
    played(ASKS)
    asked = []
    with connect("usb") as device:
        device.load(hills())
        device.arm(ask=lambda said: asked.append(said) or True)
        assert device.is_armed
    assert asked == ["put the arm into its zero pose, hold it there and press Enter"]
    assert device.is_disarmed


@posix
@pytest.mark.parametrize("ask", [None, lambda said: False], ids=["no terminal", "no"])
def test_question_without_a_yes_arms_nothing(played, monkeypatch, ask):
    played(ASKS)
    monkeypatch.setattr(sys, "stdin", open(os.devnull))
    with connect("usb") as device:
        device.load(hills())
        with pytest.raises(DeviceError, match="(?s)not answered.*zero pose"):
            device.arm(ask=ask)
        assert device.is_disarmed


@posix
def test_arm_that_is_not_armed_in_time_is_disarmed(played):
    played(
        'tell("arming", lines=["  DEAD_MAN_RELEASED: press it"], asks=None)\n'
        'sys.stdin.read()\ntell("end", disarmed=True)'
    )
    with connect("usb") as device:
        device.load(hills())
        with pytest.raises(DeviceError, match="(?s)not after 1 s.*DEAD_MAN_RELEASED"):
            device.arm(timeout=1)
        assert device.is_disarmed


@posix
@pytest.mark.parametrize("left", [True, False], ids=["disarm", "an exception"])
def test_unconfirmed_board_is_an_explicit_error(played, left):
    end = 'tell("end", disarmed=False)\nprint("error: the board did not confirm", file=sys.stderr)'
    played(f'mode("armed")\nsys.stdin.read()\n{end}\nsys.exit(1)')
    with pytest.raises(NotDisarmedError, match="switch the amplifiers off"):
        with connect("usb") as device:
            device.load(hills())
            device.arm()
            if left:
                device.disarm()
            raise ZeroDivisionError
    assert not device.is_disarmed


@posix
def test_command_that_dies_ends_the_samples(played):
    played('mode("armed")\nsys.stdin.readline()\nsys.exit(3)')
    with pytest.raises(NotDisarmedError, match="switch the amplifiers off"):
        with connect("usb") as device:
            device.load(hills())
            device.arm()
            with pytest.raises(DeviceError, match="marks"):
                device.mark("the last line that is read")
            assert list(device.samples()) == [] and not device.is_armed


@posix
def test_board_that_the_guardian_has_disarmed_is_disarmed(played):
    line = "usb: the board has confirmed that it is disarmed"
    played(f'mode("armed")\nsys.stdin.read()\nprint("{line}", file=sys.stderr)\nsys.exit(137)')
    with connect("usb") as device:
        device.load(hills())
        device.arm()
        with pytest.raises(DeviceError, match="exit code 137") as failed:
            device.disarm()
        assert device.is_disarmed and not isinstance(failed.value, NotDisarmedError)


@posix
def test_staircase_asks_a_person_on_an_arm(played, tmp_path, monkeypatch, capsys):
    played("""
    mode("armed")
    log, view, is_out = open("log", "w"), 0, False
    for line in sys.stdin:
        print(line, end="", file=log, flush=True)
        if line.startswith("mark "):
            if "stroke 2" in line and not is_out:
                is_out = True
                mode("disarmed")
                tell("arming", lines=["FAULT 6"], asks=6)
            tell("mark", marked_tick=7, marked_t_s=0.007, host_unix_s=1.0, text=line[5:-1])
        elif line == "enter 6\\n":
            mode("armed")
        else:
            view += 1
            tell("view", view=view)
            print("view %d: friction 0.6" % view, file=sys.stderr, flush=True)
    tell("end", disarmed=True)
    """)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hapterra._connect.ask_at_terminal", lambda said: said == "FAULT 6")
    words = ["friction_jnd.py", "--device", "usb", "--trials", "40", "--out", "jnd.png"]
    monkeypatch.setattr(sys, "argv", words)
    answers = itertools.cycle(["neither", "1", "2"])
    monkeypatch.setattr(
        "builtins.input", lambda said: "" if said.startswith("Stroke") else next(answers)
    )
    runpy.run_path(str(STAIRCASE), run_name="__main__")
    result = capsys.readouterr()
    assert "Weber fraction" in result.out and "friction" not in result.err
    log = (tmp_path / "log").read_text().splitlines()
    frictions = [float(line.split()[1]) for line in log if line.startswith("friction ")]
    pairs = list(zip(frictions[::2], frictions[1::2]))
    # The trial in which the dead-man switch was released is repeated.
    assert pairs[0] == pairs.pop(1) and log.count("mark repeated") == 1
    assert len(pairs) == 40 and all(min(pair) == 0.4 < max(pair) <= 1.4 for pair in pairs)
    assert [line for line in log if "answer" in line][:2] == ["mark answer 1", "mark answer 2"]


@posix
def test_recording_that_fails_is_an_error_of_a_disarmed_board(played):
    end = 'tell("end", disarmed=True)\nprint("error: disk full\\nhint: delete", file=sys.stderr)'
    played(f'mode("armed")\nsys.stdin.read()\n{end}\nsys.exit(1)')
    with connect("usb") as device:
        device.load(hills())
        device.arm()
        with pytest.raises(DeviceError, match="disk full") as failed:
            device.disarm()
        assert failed.value.hint == "delete" and device.is_disarmed


@posix
def test_unread_samples_are_dropped_and_counted(played):
    flood = """
    mode("armed")
    for tick in range(5000):
        vector = [0.0, 0.0, 0.0]
        what = dict(hip_mm=vector, proxy_mm=vector, force_n=vector)
        tell("sample", **what, state="free", mode="armed", view=tick)
    tell("end", disarmed=True)
    """
    played(flood)
    with connect("usb", buffer=100) as device:
        device.load(hills())
        device.arm()
        device.disarm()
        assert [sample.view for sample in device.samples()] == list(range(4900, 5000))
        assert device.dropped == 4900


# Questions to the user.

TERMINAL = """
import sys, time
from hapterra._terminal import ask_at_terminal
sys.stdin.readline()
time.sleep(0.5)
print("answer", ask_at_terminal("is it in its zero pose?"))
"""


@posix
@pytest.mark.parametrize("typed, answer", [("\n", "True"), ("no\n", "False"), ("\x04", "False")])
def test_enter_counts_after_the_question_is_shown(typed, answer):
    import pty

    ours, theirs = pty.openpty()
    with subprocess.Popen([sys.executable, "-c", TERMINAL], stdin=theirs, stdout=theirs,
                          stderr=theirs) as child:  # fmt: skip
        os.close(theirs)
        # The first line lets it begin; the others are typed before the question.
        os.write(ours, b"begin\n\n\n")
        shown = b""
        while b"zero pose?" not in shown:
            shown += os.read(ours, 1000)
        with pytest.raises(subprocess.TimeoutExpired):
            child.wait(1)
        os.write(ours, typed.encode())
        while not re.search(rb"answer \w+\s", shown):
            shown += os.read(ours, 1000)
    os.close(ours)
    assert shown.decode().split()[-1] == answer


@posix
def test_question_needs_a_terminal():
    import pty

    ours, theirs = pty.openpty()
    os.write(ours, b"begin\n\n")
    result = subprocess.run([sys.executable, "-c", TERMINAL], stdin=theirs, capture_output=True)
    os.close(ours)
    os.close(theirs)
    assert result.stdout == b"answer False\n", result


def test_question_is_returned_once_with_all_lines():
    session = fake_session()
    assert session.take_question() is None
    for asks, lines in [(7, ["a", "b"]), (7, ["a", "b"]), (7, ["c"])]:
        session._handle_event({"event": "arming", "lines": lines, "asks": asks})
    assert session.take_question() == (7, "a\nb\nc") and session.take_question() is None
    session._handle_event({"event": "arming", "lines": ["a"], "asks": 7})
    assert session.take_question() is None
    session._handle_event({"event": "arming", "lines": ["d"], "asks": 8})
    assert session.take_question() == (8, "d")


def fake_session(words=("run",), code="pass", **options):
    """Returns a session of a Python that runs some code."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hapterra._session.command", lambda: [sys.executable, "-c", code])
        return Session(words, lambda event: None, **options)


def line_of(text):
    return f"import sys; print({text!r}, file=sys.stderr)"


# State of the session.


@posix
def test_device_that_is_not_confirmed_stays_an_error(played):
    played('mode("armed")\nsys.stdin.read()')
    device = connect("usb")
    device.load(hills())
    device.arm()
    for _ in range(2):
        with pytest.raises(NotDisarmedError, match="switch the amplifiers off"):
            device.disarm()
    with pytest.raises(NotDisarmedError):
        device.__exit__(None, None, None)
    assert not device.is_disarmed
    played('mode("armed")\nsys.stdin.read()\ntell("end", disarmed=True)')
    with connect("usb") as again:
        again._unconfirmed = "as before"
        again.load(hills())
        again.arm()
        again.disarm()
        again.disarm()
        assert again.is_disarmed


@posix
def test_exit_code_0_confirms_nothing():
    session = fake_session()
    session.view = 0
    with pytest.raises(NotDisarmedError):
        session.end()
    session = fake_session(code=line_of("usb: the board has confirmed that it is disarmed"))
    session.view = 0
    session.end()
    assert session.is_disarmed
    session = fake_session(code=line_of("mark `the board has confirmed that it is disarmed` at tick 7"))
    session.view = 0
    with pytest.raises(NotDisarmedError):
        session.end()


@posix
def test_ctrl_c_while_it_ends_does_not_lose_the_session(played, monkeypatch):
    played('mode("armed")\nsys.stdin.read()\ntell("end", disarmed=True)')
    with connect("usb") as device:
        device.load(hills())
        device.arm()
        end = Session.end

        def interrupted(session):
            monkeypatch.setattr(Session, "end", end)
            raise KeyboardInterrupt

        monkeypatch.setattr(Session, "end", interrupted)
        with pytest.raises(KeyboardInterrupt):
            device.disarm()
        assert not device.is_disarmed
        device.disarm()
        assert device.is_disarmed


@posix
def test_samples_update_mode_and_view():
    session = fake_session()
    session._handle_event({"event": "sample", "mode": "armed", "view": 3})
    assert (session.mode, session.view) == ("armed", 3)
    session._handle_event({"event": "end", "disarmed": False})
    assert session.mode == "armed" and not session.is_disarmed


class Closed:
    def write(self, text):
        raise BrokenPipeError


@posix
def test_closed_stderr_and_half_a_line_keep_the_session(played, monkeypatch):
    played("""
    print("a line", file=sys.stderr, flush=True)
    print('{"event": "li', file=reader, flush=True)
    mode("armed")
    sys.stdin.readline()
    tell("mark", marked_tick=1, marked_t_s=0.1, host_unix_s=1.0, text="another")
    tell("mark", marked_tick=2, marked_t_s=0.2, host_unix_s=1.0, text="mine")
    sys.stdin.read()
    tell("end", disarmed=True)
    """)
    monkeypatch.setattr(sys, "stderr", Closed())
    with connect("usb") as device:
        device.load(hills())
        device.arm()
        assert device.mark("mine").tick == 2
        session = device._session
        assert not session.wait(lambda: session.has_ended, 0.5) and device.is_armed
    assert device.is_disarmed


@posix
@pytest.mark.parametrize("quiet", [False, True])
def test_quiet_session_forwards_warnings(capsys, quiet):
    lines = ["view 1: friction 0.6", "mark           `a` at tick 7", "  12.0 s free",
             "error: another host controls the device", "  DEAD_MAN_RELEASED: press it"]  # fmt: skip
    session = fake_session(code=line_of("\n".join(lines)), is_quiet=quiet)
    session.end() if quiet else session._stderr.join()
    result = capsys.readouterr().err.splitlines()
    assert result == [f"hapterra: {line}" for line in lines[3 if quiet else 0 :] if "12.0" not in line]


# Params.


@posix
def test_surface_is_set_by_params_and_unknown_after_a_time_out(played, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    played("""
    mode("armed")
    open("log", "w").close()
    for line in sys.stdin:
        print(line, end="", file=open("log", "a"))
        if line[:5] in ("reset", "stiff"):
            tell("view", view=7 + len(open("log").read()))
        if line == "friction 20.0\\n":
            tell("refused", text="a friction of 20")
    tell("end", disarmed=True)
    """)
    monkeypatch.setattr("hapterra._connect._COMMAND_TIMEOUT_S", 0.5)
    with connect("usb") as device:
        with pytest.raises(ValueError, match="connect"):
            device.load(hills(), device="usb")
        device.load(hills(), Surface(stiffness=0.5, friction=0.3))
        device.arm()
        params = device.params
        for line in ("stiffness 2", " damping 1", "at 2 reset", "on 1 friction 0.2", "enter 7"):
            with pytest.raises(DeviceError, match="not accepted as a command"):
                device.command(line)
        params.stiffness = 1.0
        device.command("reset")
        params.stiffness = 0.25
        with pytest.raises(DeviceError, match="a friction of 20"):
            params.friction = 20.0
        assert params.friction == pytest.approx(0.3)
        with pytest.raises(DeviceError, match="may still come"):
            params.friction = 0.2
        with pytest.raises(DeviceError, match="friction is unknown"):
            params.static_friction = 0.5
        device._current_surface["stiffness"] = None
        with pytest.raises(DeviceError, match="stiffness is unknown"):
            params.stiffness = 0.5
        device.command("reset")
        assert (params.stiffness, params.friction) == pytest.approx((0.5, 0.3))
    log = Path("log").read_text().splitlines()
    assert [line for line in log if line[0] == "s"] == ["stiffness 2.0", "stiffness 0.5"]


# Ends of a session.


@posix
def test_open_viewer_does_not_delay_the_end(played, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    played("""
    import subprocess
    viewer = 'sleep 6; touch closed'
    subprocess.Popen(["sh", "-c", viewer], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    mode("armed")
    sys.stdin.read()
    tell("end", disarmed=True)
    print("error: disk full", file=sys.stderr)
    sys.exit(1)
    """)
    with connect("usb") as device:
        device.load(hills())
        device.arm()
        with pytest.raises(DeviceError, match="disk full"):
            device.disarm()
        assert device.is_disarmed and list(device.samples()) == []
    assert not Path("closed").exists()


ENDS = """
import atexit, gc, os, sys, threading, time, hapterra
sys.path.insert(0, {tests!r})
from test_connect import hills
device = hapterra.connect("usb")
device.load(hills())
device.arm()
folder = device._folder
"""


def ends(text):
    """Runs Python that has armed a simulated device. Returns its output."""
    text = ENDS.format(tests=str(Path(__file__).parent)) + textwrap.dedent(text)
    words = [sys.executable, "-c", text]
    result = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert result.returncode == 0, result.stderr
    return result.stdout.splitlines()


ENDED = 'mode("armed")\nsys.stdin.read()\nopen("ended", "w")\ntell("end", disarmed=True)'


@posix
def test_thread_that_reads_samples_does_not_keep_the_arm_armed(played, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    played(ENDED)
    ends("threading.Thread(target=lambda: list(device.samples())).start()")
    assert Path("ended").exists()


@posix
def test_device_that_is_replaced_ends_its_session(played, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    played(ENDED)
    result = ends("""
    device.params
    gc.disable()
    device = None
    until = time.monotonic() + 20
    while not os.path.exists("ended") and time.monotonic() < until:
        time.sleep(0.05)
    print(os.path.exists("ended"))
    """)
    assert result == ["True"]


@posix
def test_fork_leaves_the_arm_and_its_folder_to_the_parent(played, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    played(ENDED)
    result = ends("""
    def refused(what):
        try:
            what()
        except hapterra.DeviceError as why:
            return "fork" in str(why)
    child = os.fork()
    if child == 0:
        session = device._session
        asked = [device.disarm, session.end, lambda: device.is_disarmed, device.arm]
        print([refused(it) for it in asked], flush=True)
        sys.exit()
    os.waitpid(child, 0)
    print(os.path.exists(folder), os.path.exists("ended"))
    device.disarm()
    print(device.is_disarmed)
    """)
    assert result == ["[True, True, True, True]", "True False", "True"]


@posix
def test_all_sessions_are_asked_to_end_before_one_is_awaited(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    # Each ends after both have received the request.
    code = """
    import os, sys, time
    sys.stdin.read()
    open(sys.argv[1], "w")
    while len(os.listdir()) < 2:
        time.sleep(0.05)
    """
    sessions = [fake_session([name], textwrap.dedent(code)) for name in "ab"]
    _end_all()
    assert [session._child.returncode for session in sessions] == [0, 0]


def test_staircase_averages_as_many_upper_as_lower_reversals():
    jnd_of = runpy.run_path(str(STAIRCASE))["jnd_of"]
    first = [9.0] * 4
    assert jnd_of([*first, 1.0, 4.0]) == pytest.approx(2.0)
    assert jnd_of([*first, 9.0, 1.0, 4.0]) == pytest.approx(2.0)
