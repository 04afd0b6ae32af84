#!/usr/bin/python3
"""units_trials.py OUT.json [NAME...]: what docs/SAFETY.md promises of the shipped units, under the systemd that runs here.

For check_units.sh, which boots that systemd. Beside this file stand veneer-proof, README.md and its pictures. NAME runs the trials whose
names begin with it; each begins from a cell at rest.
"""
import errno
import functools
import json
import os
import re
import signal
import socket
import stat
import struct
import sys
import threading
import time
import zlib

from booted_cell import (BACKUP, DAEMON, GUARDIAN, HERE, TWIN, Darkness, NotShown, api, begin_pattern, cgroup,
                         drop_in, empty_bed, expect, expect_back, expect_dark, expect_true, journal, laser, main_pid,
                         make_ready, name_of, of_process, pages, pids, read, run, show, state, status, systemctl,
                         time_scale, twin, twin_answers, until, veneerctl, wait_state, wait_status, without_drop_ins,
                         write)

KILLS, HANGS = 3, 2
GUARDIAN_KILLS = 12     # more than systemd's own limit of five in ten seconds

# ---- The trials, in this order ------------------------------------------------------------------------------------

TRIALS, FIGURES = [], {}


def trial(function):
    TRIALS.append(function)
    return function


@trial
def nothing_starts_by_itself():
    """Installed, and the system booted: nothing of it runs."""
    for unit in (DAEMON, GUARDIAN, TWIN, BACKUP, BACKUP + ".timer", "veneer-demo.target"):
        expect(state(unit) == "inactive", f"{unit} is {state(unit)}")


@trial
def the_daemon_never_starts_the_twin():
    """`systemctl start veneerd` brings the guardian and no simulated machine; it is there once it says that it is ready."""
    systemctl("start", DAEMON)
    expect(status() is not None, "systemd calls it started, and it does not answer")
    expect(state(GUARDIAN) == "active", "no guardian watches")
    expect(state(TWIN) == "inactive", "it started a simulated machine")
    systemctl("stop", DAEMON)
    expect(state(GUARDIAN) == "active", "the guardian went with the daemon")
    systemctl("stop", GUARDIAN)


@trial
def the_demo_starts_all_three():
    """veneer-demo.target starts twin, daemon and guardian, each as the user veneer alone and without any privilege."""
    systemctl("start", "veneer-demo.target")
    until("the twin", twin_answers)
    for unit in (DAEMON, GUARDIAN, TWIN):
        expect(state(unit) == "active", f"{unit} is {state(unit)}")
        pid = main_pid(unit)
        user = run("id", "-u", "veneer")
        expect(of_process(pid, "Uid").split() == [user] * 4, f"{unit} runs as {of_process(pid, 'Uid')}")
        for name, wanted in (("CapEff", "0" * 16), ("CapBnd", "0" * 16), ("NoNewPrivs", "1"), ("Seccomp", "2")):
            expect(of_process(pid, name) == wanted, f"{name} of {unit} is {of_process(pid, name)}")


@trial
def exposure_is_small():
    """`systemd-analyze security` of the loaded units: at most 1.5."""
    for unit in (DAEMON, GUARDIAN, TWIN, BACKUP):
        last = run("systemd-analyze", "security", "--no-pager", "--threshold=15", unit).splitlines()[-1]
        FIGURES[f"exposure of {unit}"] = float(re.search(r": ([0-9.]+)", last).group(1))


@trial
def the_unit_keeps_its_limits():
    """The loop that owns the laser, and no other thread, has nice -10; files, core and scores are as the units say."""
    make_ready()
    pid = main_pid(DAEMON)
    limits = read(f"/proc/{pid}/limits")
    for name, wanted in (("Max core file size", "1"), ("Max open files", "4096")):
        expect(re.search(rf"^{name} +{wanted} ", limits, re.M), f"{name}: {limits}")
    may_raise_limits()
    nice = {int(read(f"/proc/{pid}/task/{task}/stat").rpartition(")")[2].split()[16]): task
            for task in os.listdir(f"/proc/{pid}/task")}
    expect(nice.get(-10) == str(pid) and sorted(nice)[1] >= 0, f"nice values of its threads: {nice}")
    expect(read(f"/proc/{main_pid(GUARDIAN)}/oom_score_adj").strip() == "-900", "the guardian is killed for memory as others are")


def may_raise_limits():
    resource = 1 << 24   # CAP_SYS_RESOURCE
    if not int(of_process(1, "CapEff"), 16) & resource:
        raise NotShown("LimitNICE= and OOMScoreAdjust=: systemd itself may not raise limits here (no CAP_SYS_RESOURCE)")


def readme_commands():
    """README.md's way to the first cut piece, from the first command to the simulated hands on."""
    lines, block = [], None
    section = read(f"{HERE}/README.md").partition("\n### To the first cut piece\n")[2].partition("\n### ")[0]
    for line in section.splitlines():
        if line.startswith("```"):
            block = line[3:] if block is None else None
        elif block == "":   # what it shows stands in blocks that are called "console"
            lines.append(line)
    first = next(i for i, line in enumerate(lines) if line.startswith("veneerctl sim "))
    return "\n".join(lines[first:])


class Watch(threading.Thread):
    """What is seen of worker processes while something goes on."""

    def __init__(self):
        super().__init__()
        self.ending = threading.Event()
        self.seen = {}

    def run(self):
        folder = cgroup(DAEMON)
        while not self.ending.wait(0.02):
            for pid in [int(line) for line in read(folder + "/cgroup.procs").split()]:
                try:
                    if name_of(pid) == "veneer-worker":
                        self.seen[pid] = {"score": int(read(f"/proc/{pid}/oom_score_adj")),
                                          "nice": os.getpriority(os.PRIO_PROCESS, pid),
                                          "filters": int(of_process(pid, "Seccomp_filters")),
                                          "memory": re.search(r"^Max data size +(\S+)", read(f"/proc/{pid}/limits"), re.M).group(1)}
                except (OSError, AttributeError):
                    pass   # it has ended meanwhile

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.ending.set()
        self.join()


@trial
def workers_do_their_work():
    """README.md's way to the first cut piece under the units: scans, looks at the bed, plans, and a whole cut that is true."""
    make_ready()
    time_scale(20)
    try:
        with Watch() as watch:
            played = run("bash", "-e", "-c", f"cd {HERE}\n" + readme_commands(), check=False)
    finally:
        time_scale(1)
    expect(played.returncode == 0, played.stdout)
    expect_true()
    daemons = int(of_process(main_pid(DAEMON), "Seccomp_filters"))
    # The last that was seen of each: at first it is not confined yet.
    kept = [seen for seen in watch.seen.values() if seen["filters"] > daemons]
    expect(kept, f"no worker was seen under filters of its own: {watch.seen}")
    for seen in kept:
        expect(seen["score"] == 1000 and seen["nice"] > 0 and seen["memory"].isdigit(), f"a worker is {seen}")
    FIGURES["workers seen confined"] = len(kept)


# ---- What ends the daemon in a burn

def ended_in_a_burn(act, unit_says):
    """Ends it in a test pattern by `act`; the guardian has darkened the machine, and another daemon waits for somebody."""
    begin_pattern()
    daemon, guardian, restarts = main_pid(DAEMON), main_pid(GUARDIAN), int(show(DAEMON, "NRestarts"))
    invocation, dark = show(DAEMON, "InvocationID"), words_of_the_guardian()
    darkness = Darkness(daemon, act)
    expect_dark(darkness.after_death)
    twin("consent", given=False)   # from here on, whatever moves moves by itself
    moved = laser()["watchdog"]["moved_without_consent_mm"]
    expect_back(daemon)
    expect(main_pid(GUARDIAN) == guardian, "the guardian died with the daemon")
    until("the guardian's word that it is dark", lambda: words_of_the_guardian() > dark)
    expect(int(show(DAEMON, "NRestarts")) == restarts + 1, "systemd did not start it again")
    said = journal(f"INVOCATION_ID={invocation}")
    expect(unit_says in said, f"the unit ended otherwise: {said[-2000:]}")
    expect(laser()["watchdog"]["moved_without_consent_mm"] == moved, "the machine moved without anybody's word")
    return darkness


def words_of_the_guardian():
    return len(re.findall(" is dark$", journal("--unit", GUARDIAN), re.M))


def kill_of(unit, *more):
    return lambda: systemctl("kill", "--signal", "KILL", *more, unit)


@trial
def a_killed_daemon_leaves_it_dark():
    """SIGKILL of the whole unit, or of its main process, in a burn: dark, the guardian lives, systemd starts another that waits."""
    last = [ended_in_a_burn(kill_of(DAEMON, *more), "status=9/KILL").after_death
            for more in ((), ("--kill-whom=main",)) for _ in range(KILLS)]
    FIGURES["ms of beam after SIGKILL"] = sorted(last)


@trial
def a_hanging_daemon_is_ended():
    """SIGSTOP of the daemon in a burn: the machine goes dark by itself, the watchdog ends the daemon, the rest is as after a kill."""
    last = []
    for _ in range(HANGS):
        darkness = ended_in_a_burn(lambda: os.kill(main_pid(DAEMON), signal.SIGSTOP), "Failed with result 'watchdog'")
        last.append(expect_dark(darkness.after_act, "SIGSTOP"))
    FIGURES["ms of beam after SIGSTOP"] = sorted(last)


@trial
def both_killed_leave_it_dark():
    """Daemon and guardian killed together in a burn: ExecStopPost= darkens, or the guardian that systemd starts again."""
    last = []
    for _ in range(HANGS):
        begin_pattern()
        daemon = main_pid(DAEMON)
        darkness = Darkness(daemon, lambda: systemctl("kill", "--signal", "KILL", DAEMON, GUARDIAN))
        last.append(expect_dark(darkness.after_death))
        expect_back(daemon)
        expect(not laser()["homed"] or laser()["state"] == "Alarm", f"nobody has reset the machine: {laser()}")
    FIGURES["ms of beam after SIGKILL of both"] = sorted(last)


@trial
def stopping_is_in_order():
    """`systemctl stop` in a burn: beam off first, the unit ends in order, ExecStopPost= has run, nothing starts it again."""
    begin_pattern()
    dark = words_of_the_guardian()
    darkness = Darkness(main_pid(DAEMON), lambda: systemctl("stop", DAEMON))
    FIGURES["ms of beam after systemctl stop"] = expect_dark(darkness.after_death)
    expect(state(DAEMON) == "inactive" and show(DAEMON, "Result") == "success", f"{state(DAEMON)}, {show(DAEMON, 'Result')}")
    after = systemctl("show", "--value", "--property", "ExecStopPost", DAEMON)
    expect("status=0" in after and "start_time=[n/a]" not in after, f"ExecStopPost= has not run: {after}")
    expect(words_of_the_guardian() == dark, "the guardian had to darken what the daemon ends in order")
    expect(not laser()["beam"], "the beam is on")


@trial
def restarting_is_in_order():
    """`systemctl restart` in a burn: beam off first, and another daemon waits."""
    begin_pattern()
    daemon = main_pid(DAEMON)
    darkness = Darkness(daemon, lambda: systemctl("restart", DAEMON))
    FIGURES["ms of beam after systemctl restart"] = expect_dark(darkness.after_death)
    expect_back(daemon)


@trial
def the_console_may_restart_it():
    """`POST /restart`, the console's way: it ends in order with 4, and systemd starts it again."""
    make_ready()
    daemon, invocation = main_pid(DAEMON), show(DAEMON, "InvocationID")
    veneerctl("restart")
    expect_back(daemon)
    expect("code=exited, status=4" in journal(f"INVOCATION_ID={invocation}"), "it did not end as one that is to be restarted")


@trial
def the_guardian_always_comes_back():
    """However often the guardian dies, it is back, and the daemon is watched again."""
    make_ready()
    for _ in range(GUARDIAN_KILLS):
        guardian = main_pid(GUARDIAN)
        systemctl("kill", "--signal", "KILL", GUARDIAN)
        until("another guardian", lambda: main_pid(GUARDIAN) not in (0, guardian) or state(GUARDIAN) == "failed")
        expect(state(GUARDIAN) != "failed", "systemd has given the guardian up")
    wait_status("a guardian that watches", lambda s: s["laser"]["refusal"] is None)


@trial
def a_board_that_keeps_its_beam_is_darkened():
    """The same kills with a Lihuiyu board, whose beam stays as it was last told: only the guardian's reset ends it."""
    keep = {name: read(f"/etc/veneerd/{name}.toml") for name in (DAEMON, TWIN)}
    laser_of_board = ('kind = "lihuiyu"\nport = "twin:/var/lib/veneer-twin/laser"\n'
                      'board = "m3"\ntravel_x_mm = 520\ntravel_y_mm = 380\n')
    write(f"/etc/veneerd/{DAEMON}.toml", keep[DAEMON].replace('[laser]\nkind = "sim"', "[laser]\n" + laser_of_board, 1))
    write(f"/etc/veneerd/{TWIN}.toml", keep[TWIN].replace('controller = "grbl"', 'controller = "lihuiyu-m3"', 1))
    try:
        systemctl("restart", TWIN)
        until("the twin", twin_answers)
        systemctl("restart", DAEMON)
        last = [ended_in_a_burn(kill_of(DAEMON), "status=9/KILL").after_death for _ in range(KILLS)]
    finally:
        for name, text in keep.items():
            write(f"/etc/veneerd/{name}.toml", text)
        systemctl("restart", TWIN)
        systemctl("restart", DAEMON)
    FIGURES["ms of beam after SIGKILL, Lihuiyu"] = sorted(last)


# ---- Workers beside a cut

def begin_cut():
    """A job of a minute, cutting; its number."""
    make_ready()
    if not pages("/panels", "panels"):
        workers_do_their_work()  # leaves wood and certificates, and a daemon that was started anew
        make_ready()
    veneerctl("job", "new", f"{HERE}/docs/images/refined.jpg", "--size-mm", "30", "--patch-mm", "10")
    job = max(row["id"] for row in pages("/jobs", "jobs"))
    api("POST", f"/jobs/{job}/start")
    wait_state("Suspended")
    twin("place", sheet="panel", on="bed", face="back")
    wait_status("the panel to be found", lambda s: s["load"] and s["load"].get("found"))
    api("POST", "/commands/unsuspend")
    until("the beam", lambda: laser()["beam"])
    return job


def expect_cutting(daemon):
    expect(main_pid(DAEMON) == daemon and state(DAEMON) == "active", "the daemon went with its worker")
    now = status()
    expect(now["state"] == "Execute", f"the cut is {now['state']}: {now['reason']}")


def large_picture():
    """Grey, and large enough that a worker takes some 700 MB for it."""
    side, path = 12000, "/tmp/large.png"

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    packer = zlib.compressobj(1)
    row = b"\0" + bytes(x * 7 & 255 for x in range(side))
    pixels = b"".join(packer.compress(row) for _ in range(side)) + packer.flush()
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)) +
                   chunk(b"IDAT", pixels) + chunk(b"IEND", b""))
    return path


def plan(picture):
    """What is said of it, good or bad, in one line."""
    done = run("veneerctl", "job", "plan", picture, "--size-mm", "30", "--patch-mm", "10", check=False)
    return done.returncode, done.stdout.splitlines()[-1]


@trial
def a_killed_worker_costs_its_task():
    """SIGKILL of a worker beside a cut costs its plan, with one sentence; the cut goes on to its end, and the wood is true."""
    begin_cut()
    daemon = main_pid(DAEMON)
    killed = []

    def kill_the_planner():
        worker = until("a worker", lambda: [pid for pid in pids(DAEMON) if name_of(pid) == "veneer-worker"])
        killed.append(worker[0])
        os.kill(worker[0], signal.SIGKILL)

    # The cut's own looks at the bed are workers, too: between them the only one is the plan's.
    killer = threading.Thread(target=kill_the_planner)
    killer.start()
    result, sentence = plan(large_picture())
    killer.join()
    expect(result != 0 and "was killed" in sentence, f"killed {killed}, and it says: {sentence}")
    expect_cutting(daemon)
    wait_state("Complete", "Aborted", "Held", "Stopped")
    expect(status()["state"] == "Complete", f"the cut ended {status()['state']}: {status()['reason']}")
    empty_bed()
    expect_true()


@trial
def a_worker_without_memory_costs_its_task():
    """A worker that the kernel kills for memory in the unit's cgroup costs its plan; the unit goes on (OOMPolicy=continue), the cut too."""
    picture = large_picture()
    job = begin_cut()
    daemon, group = main_pid(DAEMON), MemoryLimit(200 << 20)
    try:
        result, sentence = plan(picture)
        kills = group.kills()
    finally:
        group.lift()
    expect(kills == 1, f"the kernel killed {kills} for memory")
    expect(result != 0 and "was killed" in sentence, f"it says: {sentence}")
    expect_cutting(daemon)
    api("POST", "/commands/abort")
    wait_state("Aborted")
    api("POST", "/commands/clear")
    api("POST", f"/jobs/{job}/cancel")
    FIGURES["memory limit"] = group.what
    if not group.of_systemd:
        raise NotShown("OOMPolicy=continue itself: systemd has no memory controller here. The kernel's kill was tried, in a group "
                       "of the trial's own: the worker alone went, with its sentence, and the cut went on")


class MemoryLimit:
    """So much more than the unit has now: MemoryMax=, or where systemd has no memory controller a group of our own."""
    MOUNTED = "/run/units-memory"

    def __init__(self, more):
        self.of_systemd = "memory" in read("/sys/fs/cgroup/cgroup.controllers").split()
        if self.of_systemd:
            self.what = "MemoryMax="
            self.before = self.kills_of_systemd()
            systemctl("set-property", "--runtime", DAEMON + ".service", f"MemoryMax={int(show(DAEMON, 'MemoryCurrent')) + more}",
                      "MemorySwapMax=0")
            return
        self.what = "a group of cgroup v1's memory controller"
        os.makedirs(self.MOUNTED, exist_ok=True)
        if not os.path.ismount(self.MOUNTED) and run("mount", "-t", "cgroup", "-o", "memory", "cgroup", self.MOUNTED, check=False).returncode:
            raise NotShown("want of memory: there is no memory controller here")
        self.group = f"{self.MOUNTED}/{os.uname().nodename}"  # the machine's, of which each campaign is another
        os.makedirs(self.group, exist_ok=True)
        self.move(self.group)
        write(f"{self.group}/memory.limit_in_bytes", str(int(read(f"{self.group}/memory.usage_in_bytes")) + more))

    @staticmethod
    def kills_of_systemd():
        return int(re.search(r"^oom_kill (\d+)", read(cgroup(DAEMON) + "/memory.events"), re.M).group(1))

    @staticmethod
    def move(group):
        for pid in pids(DAEMON):
            write(f"{group}/cgroup.procs", str(pid))

    def kills(self):
        if self.of_systemd:
            return self.kills_of_systemd() - self.before
        return int(re.search(r"^oom_kill (\d+)", read(f"{self.group}/memory.oom_control"), re.M).group(1))

    def lift(self):
        if self.of_systemd:
            systemctl("revert", DAEMON + ".service")
            return
        self.move(self.MOUNTED)
        os.rmdir(self.group)
        run("umount", self.MOUNTED)


@trial
def a_kill_in_a_cut_leaves_the_wood_true():
    """SIGKILL in a cut: dark, another daemon waits, no piece is called cut that is not, none free that is burnt."""
    job = begin_cut()
    until("a piece", lambda: status()["job"]["cut"] > 0)
    until("the beam", lambda: laser()["beam"])
    daemon = main_pid(DAEMON)
    FIGURES["ms of beam after SIGKILL in a cut"] = expect_dark(Darkness(daemon, kill_of(DAEMON)).after_death)
    now = expect_back(daemon)
    wait_status("the database's check", lambda s: s["database"]["state"] == "good")
    empty_bed()
    expect_true()
    states = [piece["state"] for piece in pages(f"/jobs/{job}/pieces", "pieces")]
    expect("cutting" not in states, f"a piece is being cut by nobody: {states}")
    expect(api("GET", f"/jobs/{job}")["state"] != "running", "the job runs without a daemon")
    FIGURES["after SIGKILL in a cut"] = f"{now['state']}; " + ", ".join(f"{states.count(s)} {s}" for s in sorted(set(states)))


# ---- What the units may reach

# Major and minor numbers, and the units that may open it. Consoles have the number of serial lines (ttyS), by which the
# kernel tells devices apart: their own permissions keep them.
LASER_UNITS = (DAEMON, GUARDIAN)
DEVICES = {"null": (1, 3, (DAEMON, GUARDIAN, TWIN)), "mem": (1, 1, ()), "kmsg": (1, 11, ()), "sda": (8, 0, ()),
           "input": (13, 64, ()), "fuse": (10, 229, ()), "video0": (81, 0, (DAEMON,)), "ttyS0": (4, 64, LASER_UNITS),
           "ttyUSB0": (188, 0, LASER_UNITS), "ttyACM0": (166, 0, LASER_UNITS), "ttyAMA0": (204, 64, LASER_UNITS),
           "usb": (189, 0, LASER_UNITS)}


def in_cgroup_of(unit, act):
    """The errno with which `act` fails in a process of the unit's cgroup, 0 when it does not; without a unit, outside."""
    child = os.fork()
    if child == 0:
        try:
            if unit:
                write(cgroup(unit) + "/cgroup.procs", "0")
            act()
            os._exit(0)
        except OSError as error:
            os._exit(error.errno or errno.ETIMEDOUT)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


@trial
def the_units_open_their_devices_alone():
    """A process in the units' cgroups opens the cell's devices, also those whose driver is not loaded yet, and no other, root or not."""
    make_ready()
    for name, (major, minor, units) in DEVICES.items():
        path = f"/dev/units-{name}"
        kind = stat.S_IFBLK if name == "sda" else stat.S_IFCHR
        os.mknod(path, 0o600 | kind, os.makedev(major, minor))
        opening = functools.partial(lambda at: os.close(os.open(at, os.O_RDONLY | os.O_NONBLOCK | os.O_NOCTTY)), path)
        try:
            outside = in_cgroup_of(None, opening)
            expect(outside not in (errno.EPERM, errno.EACCES), f"{name} cannot be opened outside the units either: {os.strerror(outside)}")
            for unit in (DAEMON, GUARDIAN, TWIN):
                got = in_cgroup_of(unit, opening)
                expect(got == (outside if unit in units else errno.EPERM), f"{name} in {unit}: {os.strerror(got)}, outside: {os.strerror(outside)}")
        finally:
            os.unlink(path)


def answers(address):
    """Nobody listens there, and so it says at once; what is filtered says nothing."""
    try:
        socket.create_connection((address, 9), timeout=3).close()
    except ConnectionRefusedError:
        pass


EXAMPLES = {"other-machines": "192.168.1.9", "network-devices": "192.168.1.40", "notifications": "192.168.1.7", "usb-scanner": None}


@trial
def only_drop_ins_open_the_network():
    """As shipped the units reach this machine alone; each drop-in lets the daemon start, and opens what it names and nothing else."""
    make_ready()
    for address in filter(None, EXAMPLES.values()):
        expect(in_cgroup_of(None, lambda to=address: answers(to)) == 0, f"{address} is no address of this system: see check_units.sh")
    for name, opened in {"": None, **EXAMPLES}.items():
        if name:
            drop_in(DAEMON, f"{name}.conf", read(f"/usr/share/doc/veneerd/{name}.conf"))
            systemctl("restart", DAEMON)
            expect(status() is not None, f"with {name}.conf it does not answer")
            if name == "network-devices":
                drop_in(GUARDIAN, f"{name}.conf", read(f"/usr/share/doc/veneerd/{name}.conf"))
                systemctl("restart", GUARDIAN)
        for address in ("127.0.0.1", *filter(None, EXAMPLES.values())):
            reached = in_cgroup_of(DAEMON, lambda to=address: answers(to)) == 0
            wanted = address in ("127.0.0.1", opened) or name == "other-machines"
            expect(reached == wanted, f"with {name or 'no drop-in'} {address} is {'reached' if reached else 'not reached'}")
        if name == "usb-scanner":
            groups = of_process(main_pid(DAEMON), "Groups").split()
            expect(run("getent", "group", "scanner").split(":")[2] in groups, f"it is not in the group scanner: {groups}")
        without_drop_ins()
    systemctl("restart", DAEMON, GUARDIAN)


@trial
def backups_are_made():
    """veneerd-backup.service makes a backup; its timer makes up the one that a machine which was off has missed."""
    make_ready()
    before = len(api("GET", "/backups")["backups"])
    systemctl("start", BACKUP)
    expect(show(BACKUP, "Result") == "success", f"the backup's unit: {show(BACKUP, 'Result')}")
    expect(len(api("GET", "/backups")["backups"]) == before + 1, "it made no backup")
    os.makedirs("/var/lib/systemd/timers", exist_ok=True)
    stamp = f"/var/lib/systemd/timers/stamp-{BACKUP}.timer"
    write(stamp, "")
    long_ago = time.time() - 2 * 86400
    os.utime(stamp, (long_ago, long_ago))
    os.makedirs(f"/run/systemd/system/{BACKUP}.timer.d", exist_ok=True)
    write(f"/run/systemd/system/{BACKUP}.timer.d/at-once.conf", "[Timer]\nRandomizedDelaySec=0\n")
    systemctl("daemon-reload")
    systemctl("start", BACKUP + ".timer")
    until("the timer's backup", lambda: len(api("GET", "/backups")["backups"]) == before + 2)
    until("the timer to name the next night", lambda: show(BACKUP + ".timer", "NextElapseUSecRealtime"))
    systemctl("stop", BACKUP + ".timer")


def main(out, names):
    failed, rows = 0, []
    for one in TRIALS:
        if names and not one.__name__.startswith(tuple(names)):
            continue
        began = time.monotonic()
        result, why = "pass", ""
        try:
            one()
        except NotShown as reason:
            result, why = "not shown here", str(reason)
        except Exception as error:   # whatever it is, the other trials are worth having
            result, why, failed = "FAIL", f"{type(error).__name__}: {error}", 1
            why += "\n" + journal("--boot", "--lines=40")
        rows.append({"trial": one.__name__, "result": result, "why": why.partition("\n")[0], "seconds": round(time.monotonic() - began, 1)})
        print(f"{result:<15}{one.__name__.replace('_', ' ')}{': ' + why if why else ''}", flush=True)
    for name, figure in FIGURES.items():
        print(f"{'':15}{name}: {figure}", flush=True)
    write(out, json.dumps({"schema_version": 1, "systemd": run("systemctl", "--version").splitlines()[0], "trials": rows, "figures": FIGURES}))
    return failed


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
