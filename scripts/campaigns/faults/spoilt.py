"""The case "spoilt" of scripts/campaigns/faults.sh: a session's directory that another has prepared, kind by kind and
file by file. The daemon goes on with it or refuses it in one line; nothing outside is touched, and nothing hangs."""
import contextlib
import hashlib
import os
import re
import shutil
import socket
import stat
import subprocess
import time

from attack import OPERATOR, Client
from programs import BIN, INSERTION, Daemon, Row, read, running

SCENE = "config/exercises/scenes/09_whole_implant.toml"
MOST_SECONDS = 10.0
GIGABYTE = 1 << 30


def files_of_a_session():
    """Its names, as apps/session/session_folder.h lists them, a changed plan and a kept state."""
    text = read("apps/session/session_folder.h")
    names = re.findall(r'"([a-z_]+\.(?:csv|jsonl|json|html))"', text)
    return sorted(set(names)) + ["plan_change_1.toml", "states"]


# --- what is done to a file; `victim` lies outside ---


def replace(path):
    if os.path.isdir(path) and not os.path.islink(path):
        shutil.rmtree(path)
    elif os.path.lexists(path):
        os.remove(path)


def put(path, data, mode=0o600):
    replace(path)
    with open(path, "wb") as file:
        file.write(data)
    os.chmod(path, mode)


def sparse(path, size):
    put(path, b"")
    os.truncate(path, size)


def bytes_of(path):
    if not os.path.isfile(path):
        return b"t_s,x\n1,2\n"
    with open(path, "rb") as file:
        return file.read()


def link(path, target):
    replace(path)
    os.symlink(target, path)


def hard_link(path, victim):
    replace(path)
    os.link(victim, path)


def fifo(path):
    replace(path)
    os.mkfifo(path)


def unix_socket(path):
    replace(path)
    with contextlib.closing(socket.socket(socket.AF_UNIX)) as listening:
        listening.bind(path)


def directory(path):
    replace(path)
    os.makedirs(path + "/within")


def device(path, kind, major, minor):
    replace(path)
    os.mknod(path, kind | 0o666, os.makedev(major, minor))


def given_to(path, user):
    if not os.path.lexists(path):
        put(path, b"x\n")
    os.chown(path, user, user)


def with_mode(path, mode):
    if not os.path.lexists(path):
        put(path, b"x\n")
    os.chmod(path, mode)


KINDS = {
    "link to a file outside": lambda p, v: link(p, v),
    "link that leads nowhere": lambda p, v: link(p, v + ".none"),
    "link to itself": lambda p, v: link(p, os.path.basename(p)),
    "link to a folder": lambda p, v: link(p, os.path.dirname(v)),
    "link to /dev/null": lambda p, v: link(p, "/dev/null"),
    "link to /dev/zero": lambda p, v: link(p, "/dev/zero"),
    "link to /dev/full": lambda p, v: link(p, "/dev/full"),
    "link to a file beside it": lambda p, v: link(p, "beside.txt"),
    "second name of a file outside": hard_link,
    "FIFO": lambda p, v: fifo(p),
    "socket": lambda p, v: unix_socket(p),
    "folder": lambda p, v: directory(p),
    "device null": lambda p, v: device(p, stat.S_IFCHR, 1, 3),
    "device zero": lambda p, v: device(p, stat.S_IFCHR, 1, 5),
    "device full": lambda p, v: device(p, stat.S_IFCHR, 1, 7),
    "block device": lambda p, v: device(p, stat.S_IFBLK, 7, 0),
    "another user's": lambda p, v: given_to(p, 65534),
    "read-only": lambda p, v: with_mode(p, 0o400),
    "no permission": lambda p, v: with_mode(p, 0),
    "for all to write": lambda p, v: with_mode(p, 0o666),
    "set-user-ID": lambda p, v: with_mode(p, 0o4700),
    "a terabyte": lambda p, v: sparse(p, 1024 * GIGABYTE),
    "three gigabytes": lambda p, v: sparse(p, 3 * GIGABYTE),
    "empty": lambda p, v: put(p, b""),
    "one line break": lambda p, v: put(p, b"\n"),
    "last line torn": lambda p, v: put(p, bytes_of(p)[:-3]),
    "without its header": lambda p, v: put(p, bytes_of(p).partition(b"\n")[2]),
    "another header": lambda p, v: put(p, b"a,b,c\n1,2,3\n4,5"),
    "line ends of DOS": lambda p, v: put(p, bytes_of(p).replace(b"\n", b"\r\n")),
    "NULs behind": lambda p, v: put(p, bytes_of(p) + bytes(4096)),
    "noise": lambda p, v: put(p, hashlib.sha512(p.encode()).digest() * 50),
    "one line of a megabyte": lambda p, v: put(p, b"7" * (1 << 20)),
    "nan": lambda p, v: put(p, re.sub(rb"(?m),[-0-9.e]+$", b",nan", bytes_of(p))),
    "twice": lambda p, v: put(p, bytes_of(p) * 2),
    "not there": lambda p, v: replace(p),
}


def state_of(paths):
    """Mode, owner, size, time and hash of files outside."""
    found = {}
    for path in paths:
        about = os.lstat(path)
        with open(path, "rb") as file:
            found[path] = (about.st_mode, about.st_uid, about.st_size, about.st_mtime_ns, about.st_nlink,
                           hashlib.sha256(file.read()).hexdigest())
    return found


def whole_session(folder):
    """A session with every file: a hand, a changed plan."""
    session = f"{folder}/session"
    with running(
        Daemon(folder, "--session", session, "--play", "--trajectory", INSERTION, "--duration", "14", scene=SCENE)
    ) as daemon:
        operator = Client(daemon.port, OPERATOR, None)
        operator.welcomed.wait(5)
        daemon.process.wait(40)
        operator.end()
    return session


def spoilt(folder, short):
    """A session's directory prepared by another: links, FIFOs, devices, others' files, torn and huge ones."""
    whole = whole_session(folder)
    names = files_of_a_session()
    kinds = list(KINDS)[:: 6 if short else 1]
    faults, taken, refused, longest = [], 0, 0, 0.0
    for kind in kinds:
        for name in names:
            session, outside = f"{folder}/s", f"{folder}/outside"
            for old in (session, outside):
                shutil.rmtree(old, ignore_errors=True)
            shutil.copytree(whole, session)
            os.makedirs(outside)
            victim = f"{outside}/victim.txt"
            put(victim, b"of another program: do not touch\nlast line without end", 0o644)
            put(f"{session}/beside.txt", b"beside\nlast line", 0o644)
            KINDS[kind](f"{session}/{name}", victim)
            before = state_of([victim, f"{session}/beside.txt"])
            begin = time.monotonic()
            try:
                ended = subprocess.run(
                    [BIN + "brachyd", "--config", SCENE, "--port", "0", "--session", session,
                     "--duration", "0.2"],
                    capture_output=True, text=True, errors="replace", timeout=MOST_SECONDS, check=False,
                )
            except subprocess.TimeoutExpired:
                faults.append(f"{kind}: {name}: hangs")
                continue
            longest = max(longest, time.monotonic() - begin)
            told = [line for line in ended.stderr.splitlines() if line.startswith("brachyd: ")]
            if ended.returncode == 0:
                taken += 1
            elif ended.returncode == 2 and len(told) == 1 and session in told[0]:
                refused += 1
            else:
                faults.append(f"{kind}: {name}: exit {ended.returncode}: {ended.stderr[-200:]!r}")
            if state_of(before) != before:
                faults.append(f"{kind}: {name}: a file outside was touched")
    return [
        Row(
            f"{len(kinds)} kinds of {len(names)} files",
            f"{taken} gone on with, {refused} refused in one line, after {longest:.1f} s at most; {len(faults)} "
            "otherwise" + "".join("; " + fault for fault in faults[:5]),
            f"nothing outside touched, nothing hangs, {MOST_SECONDS:.0f} s",
            not faults,
        )
    ]
