"""The cell of the shipped units in a booted system: its systemd, its daemon, its twin, what ends a burn, and what the wood says.

For units_trials.py. Root's, in a system that serves nothing else; veneer-proof stands beside this file.
"""
import http.client
import json
import os
import re
import select
import socket
import subprocess
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
DAEMON, GUARDIAN, TWIN, BACKUP = "veneerd", "veneer-guardian", "veneer-twin", "veneerd-backup"
API, MACHINE = "/run/veneerd/veneerd.sock", "/run/veneer-twin/twin.sock"
DARK_MS = 1000          # the promise: beam off so soon after any death
WATCHED_MS = 2500       # and so long it is looked at
PATIENCE = 600          # s; a machine may be slow, so nothing else here is held against a clock


class Broken(Exception):
    """A promise that was not kept."""


class NotShown(Exception):
    """What cannot be tried on this machine, and why."""


def expect(true, sentence):
    if not true:
        raise Broken(sentence)


def until(what, test, patience=PATIENCE):
    """What `test` gives as soon as it gives something; the pause only bounds how often it is asked."""
    end = time.monotonic() + patience
    while True:
        got = test()
        if got:
            return got
        expect(time.monotonic() < end, f"waited in vain for {what}")
        time.sleep(0.02)


# ---- systemd ------------------------------------------------------------------------------------------------------

def run(*command, check=True, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False, **options)
    expect(done.returncode == 0 or not check, f"{' '.join(command)}: {done.stdout.strip()}")
    return done.stdout.strip() if check else done


def systemctl(*arguments):
    return run("systemctl", *arguments)


def show(unit, name):
    return systemctl("show", "--value", "--property", name, unit)


def state(unit):
    return show(unit, "ActiveState")


def main_pid(unit):
    return int(show(unit, "MainPID"))


def cgroup(unit):
    return "/sys/fs/cgroup" + show(unit, "ControlGroup")


def pids(unit):
    with open(cgroup(unit) + "/cgroup.procs", encoding="ascii") as file:
        return [int(line) for line in file]


def read(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def write(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)


def of_process(pid, name):
    return re.search(rf"^{name}:\s*(.*)$", read(f"/proc/{pid}/status"), re.M).group(1)


def name_of(pid):
    try:
        return os.path.basename(os.readlink(f"/proc/{pid}/exe"))
    except OSError:
        return ""


def drop_in(unit, name, text):
    folder = f"/run/systemd/system/{unit}.service.d"
    os.makedirs(folder, exist_ok=True)
    write(f"{folder}/{name}", text)
    systemctl("daemon-reload")


def without_drop_ins():
    run("sh", "-c", "rm -rf /run/systemd/system/*.service.d /run/systemd/system/*.timer.d")
    systemctl("daemon-reload")


def journal(*match):
    return run("journalctl", "--no-pager", "--output=cat", *match)


# ---- the cell -----------------------------------------------------------------------------------------------------

class UnixConnection(http.client.HTTPConnection):
    def __init__(self):
        super().__init__("cell", timeout=PATIENCE)

    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.sock.settimeout(PATIENCE)
        self.sock.connect(API)


class Refused(Broken):
    """The cell's own sentence."""


def api(method, path, body=None):
    connection = UnixConnection()
    try:
        connection.request(method, "/api/v1" + path, None if body is None else json.dumps(body),
                           {"Content-Type": "application/json"})
        reply = connection.getresponse()
        said = json.loads(reply.read() or b"null")
    finally:
        connection.close()
    if reply.status >= 300:
        raise Refused(f"{method} {path}: {said}")
    return said


def status():
    """None: it does not answer."""
    try:
        return api("GET", "/status")
    except (OSError, http.client.HTTPException):
        return None


def wait_status(what, test):
    return until(what, lambda: (lambda s: s if s and test(s) else None)(status()))


def wait_state(*names):
    return wait_status(" or ".join(names), lambda s: s["state"] in names)


def twin(cmd, **arguments):
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as door:
        door.settimeout(PATIENCE)
        door.connect(MACHINE)
        door.sendall(json.dumps({"cmd": cmd, **arguments}).encode() + b"\n")
        line = door.makefile().readline()
    said = json.loads(line)
    expect(said.get("ok"), f"the twin refuses {cmd}: {line}")
    return said


def twin_answers():
    try:
        return twin("status")
    except OSError:
        return None


def laser():
    return twin("status")["laser"]


def veneerctl(*arguments):
    return run("veneerctl", *arguments)


def time_scale(factor):
    for name in (DAEMON, TWIN):
        run("sed", "-i", f"s/^time_scale = [0-9]*/time_scale = {factor}/", f"/etc/veneerd/{name}.toml")
    systemctl("restart", TWIN)
    until("the twin", twin_answers)
    systemctl("restart", DAEMON)


# ---- a burn, and what ends it -------------------------------------------------------------------------------------

def empty_bed():
    for sheet in twin("status")["sheets"]:
        if sheet["where"] == "bed":
            twin("lift", **{"from": "bed"})


def make_ready():
    """At rest, homed, with nothing on the bed, whatever was before."""
    without_drop_ins()
    systemctl("reset-failed")
    systemctl("start", "veneer-demo.target", GUARDIAN)
    until("the twin", twin_answers)
    twin("consent", given=True)
    empty_bed()
    wait_status("the daemon", lambda s: s["database"]["state"] == "good" and not s["laser"].get("refusal"))
    if status()["state"] == "Held":
        api("POST", "/commands/abort")
    if status()["state"] == "Aborted":
        api("POST", "/commands/clear")
    if status()["state"] != "Idle":
        api("POST", "/commands/reset")
    wait_state("Idle")


def begin_pattern():
    make_ready()
    # What was cut before lay there last: the bed is empty, as the twin says.
    task = api("POST", "/laser/test-pattern", {"size_mm": 200, "confirmed": [*status()["confirm"], "scrap on the bed"]})["task"]

    def burns():
        now = api("GET", f"/tasks/{task}")
        expect(now["state"] == "running", f"the pattern: {now}")
        return laser()["beam"]

    until("the beam", burns)


class Darkness:
    """Does what ends the process `pid`, and looks at the beam until some time after its death."""

    def __init__(self, pid, act):
        death, done = [], []
        handle = os.pidfd_open(pid)

        def wait_for_death():
            if select.select([handle], [], [], PATIENCE)[0]:
                death.append(time.monotonic())

        def do():
            act()
            done.append(time.monotonic())

        watching, acting = threading.Thread(target=wait_for_death), threading.Thread(target=do)
        watching.start()
        acting.start()
        seen = 0
        while not death or time.monotonic() < death[0] + WATCHED_MS / 1000:
            expect(watching.is_alive() or death, "the process does not die")
            if laser()["beam"]:
                seen = time.monotonic()
        acting.join()
        os.close(handle)
        # In ms, when the beam was last seen on: after the death, and after what led to it was done.
        self.after_death = max(0, round(1000 * (seen - death[0])))
        self.after_act = max(0, round(1000 * (seen - done[0])))


def expect_dark(milliseconds, after="the death"):
    expect(milliseconds <= DARK_MS, f"the beam was on {milliseconds} ms after {after}")
    return milliseconds


def expect_back(before):
    """Another daemon is there, waits for somebody, and nothing has stirred."""
    now = wait_status("another daemon", lambda s: main_pid(DAEMON) not in (0, before) and state(DAEMON) == "active")
    expect(now["state"] in ("Aborted", "Stopped"), f"it is {now['state']} without anybody's word")
    return now


# ---- The wood -----------------------------------------------------------------------------------------------------

def pages(path, key):
    rows, cursor = [], ""
    while True:
        page = api("GET", f"{path}?limit=1000{cursor}")
        rows += page[key]
        if page["next"] is None:
            return rows
        cursor = f"&cursor={page['next']}"


def claims():
    """What the cell says of its wood, as veneer-proof reads it."""
    panels, ledger, poses, jobs, loads = [], [], [], [], {}
    for panel in pages("/panels", "panels"):
        name, whole = panel["id"], api("GET", f"/panels/{panel['id']}")
        marks = [{"kind": f["kind"], "tag_id": f["tag_id"], "face": f["face"], "x_mm": f["centre_mm"][0], "y_mm": f["centre_mm"][1]}
                 for f in whole["fiducials"]]
        panels.append({"id": name, "fiducials": marks, "tags": [m["tag_id"] for m in marks if m["kind"] == "tag"],
                       "width_mm": whole["width_mm"], "height_mm": whole["height_mm"]})
        ledger += [{"panel": name, **{key: row[key] for key in ("mark", "job", "state", "outline_mm", "allocation_mm")}}
                   for row in pages(f"/panels/{name}/ledger", "allocations")]
    for job in sorted(pages("/jobs", "jobs"), key=lambda job: job["id"]):
        number, whole = job["id"], api("GET", f"/jobs/{job['id']}")
        for one in whole["runs"]:
            poses.append({"panel": one["panel"], "sheet_load": loads.get(one["panel"], 0), "bed_from_panel": one["bed_from_panel"]})
            loads[one["panel"]] = loads.get(one["panel"], 0) + 1
        jobs.append({"job": number, "width_mm": whole["width_mm"], "height_mm": whole["height_mm"],
                     "pieces": pages(f"/jobs/{number}/pieces", "pieces")})
    return {"panels": panels, "poses": poses, "jobs": jobs, "ledger": ledger}


def expect_true():
    """No wood that was burnt is called free or reserved, none that is there is called cut: asked of what the twin burnt."""
    out = "/tmp/proof"
    os.makedirs(out, exist_ok=True)
    write(f"{out}/claims.json", json.dumps(claims()))
    run(f"{HERE}/veneer-proof", "--twin-state", "/var/lib/veneer-twin", "--claims", f"{out}/claims.json", "--out", out)
    proof = json.loads(read(f"{out}/proof.json"))
    for job in proof["jobs"]:
        expect(job["ledger_matches_burn"] is True, f"ledger and burnt wood differ: {job}")
    expect(proof["unclaimed_cuts"] == 0, f"{proof['unclaimed_cuts']} cuts that nobody claims")
