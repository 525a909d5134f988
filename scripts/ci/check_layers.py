#!/usr/bin/env python3
"""Checks who includes whom, against the tables "Directories" in the README.md of core, haptics, net, apps, apps/lab.

A directory includes only directories above it in the table of its tree, and the trees only each other as TREES says.
So the include graph between directories has no cycle, and neither have the imports between the viewer's files and
between their directories. The laboratory, apps/lab, is a tree that no other includes, nor do tests outside of
tests/apps/lab, and no CMake list of the product's sources names its targets. What clients may ask, net/requests,
reaches no socket and no thread. Also what must stay in one file: libraries, threads, atomics, locks.

usage: scripts/ci/check_layers.py [--root DIR]     exit code 1 and a line for each breach
"""
import pathlib
import re
import sys

from complaints import end, root_of

# A tree includes itself and these.
TREES = {"core": (), "haptics": ("core",), "net": ("core",), "apps": ("core", "haptics", "net"),
         "apps/lab": ("core", "haptics", "net", "apps")}
LAB, LAB_TESTS = "apps/lab", "tests/apps/lab"

# What a pattern matches stays in files whose path matches.
ONE_PLACE = [
    (r"#include <assimp/", r"core/geometry/mesh_io/mesh_file\.cpp", "assimp"),
    (r"#include <CLI/", r"apps/command_line/command_line_parts\.h", "CLI11"),
    (r'#include "apps/command_line/command_line_parts\.h"',
     r"apps/(command_line/[a-z_]*|lab/program/study_line)\.cpp", "CLI11's header"),
    (r"#include <toml\+\+/", r"core/base/toml_table\.cpp", "tomlplusplus"),
    (r'#include "core/base/toml_table\.h"',
     r"core/(base/toml_table\.cpp|scene/file/.*|"
     r"brachytherapy/(plan/plan_toml|dose/source_toml|hdr/hdr_plan_toml)\.cpp|brachytherapy/plan/hole_names\.h)|"
     r"apps/score/exercise\.cpp",
     "reading TOML"),
    (r"#include <boost/beast",
     r"net/http/(http_listener\.cpp|websocket_connection\.h)|apps/examples/haply_device\.cpp", "Boost.Beast"),
    (r'#include "net/http/websocket_connection\.h"', r"net/http/http_listener\.cpp", "Boost.Beast's header"),
    (r"#include <nats", r"net/broker/nats_link\.cpp", "libnats"),
    (r"#include <pybind11/", r"apps/python/engine/module\.cpp", "pybind11"),
    (r"#include <(openssl/|boost/asio/ssl)", r"net/(transport/tls|access)/.*|apps/session/sha256\.cpp", "OpenSSL"),
    (r"#include <(stdatomic\.h|atomic)>|\bstd::atomic|\b_Atomic\b|\b__(atomic|sync)_",
     r"core/(realtime/triple_buffer\.h|models/landmark_set\.cpp)", "atomics"),
    # `std::thread::hardware_concurrency` creates none.
    (r"\bstd::j?thread\b(?!::)|\bpthread_create\b|\bthrd_create\b|\bstd::async\b|\bstd::execution::(par|unseq)|"
     r"#include <execution>",
     r"apps/(daemon/daemon\.(h|cpp)|brachy/live/relay\.cpp)", "creating threads"),
    (r"\b(thread_pool|system_context|system_executor|static_thread_pool)\b",
     r"apps/(daemon/io/event_loop|brachy/live/relay)\.cpp", "a pool of threads (TLS handshakes beside the event loop)"),
    (r"#\s*pragma\s+omp\b|#include <omp\.h>", r"core/base/share_out\.h|apps/bench/paper_baseline\.cpp",
     "OpenMP's threads"),
    (r"\bstd::(\w*mutex|condition_variable|\w*semaphore|latch|barrier|call_once|once_flag)|"
     r"\bpthread_(mutex|cond|rwlock|spin)|#include <(mutex|shared_mutex|condition_variable|semaphore|latch|barrier)>",
     r"apps/daemon/service/stderr_sink\.h", "a lock (of spdlog's sinks)"),
    (r"reinterpret_cast", r"(?!net/).*", "reinterpret_cast (never of wire bytes)"),
    (r"\bmonotonic_ns\(|monotonic_clock\(|steady_timer|(steady|system)_clock|sleep_for",
     r"(?!net/).*|net/base/clock\.(h|cpp)", "the real time in net (a TimerClock gives it)"),
    # What comes from the network never becomes a file's name or content.
    (r"#include <(fstream|filesystem)>",
     r"(?!net/).*|net/(http/served_files|access/token_file|transport/tls/tls_context)\.(h|cpp)",
     "opening files in net"),
    (r'#include "core/(geometry/mesh_io|scene)/', r"(?!net/).*", "reading meshes and scenes"),
]
# What these sources include, directly or not, has neither sockets nor threads.
WITHOUT_IO = "net/requests"
IO = r"^\s*#\s*include\s*<(boost/(?:asio|beast)[^>]*|thread|stop_token|future|pthread\.h|sys/socket\.h)>"
TOP_LEVEL = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "SECURITY.md", "README.md", "apps", "core", "net",
             "haptics", "config", "tests", "scripts", "build", "out"}
MOST_TOP_DIRECTORIES = 13  # of core
# Endings of C++; only .h and .cpp are allowed, and in C_EXAMPLES .c; the others are seen, too.
ALL_CPP = (".h", ".cpp", ".hpp", ".hh", ".hxx", ".cc", ".cxx", ".c", ".ipp", ".inl", ".inc", ".tpp")
C_EXAMPLES = "apps/examples"  # programs on the C API
VIEWER = "apps/viewer/src"


def table(root, tree):
    """The directories of a tree from bottom to top, as its README.md lists them."""
    text = (root / tree / "README.md").read_text()
    section = re.search(r"^## Directories\n(.*?)(?=^## |\Z)", text, re.M | re.S)
    if not section:
        sys.exit(f"layers: {tree}/README.md has no section \"## Directories\"")
    return [tree if name == "." else f"{tree}/{name}" for name in re.findall(r"^\| `([^`]+)` \|", section[1], re.M)]


def tree_of(path):
    """The tree that a path lies in, the laboratory before apps; else its first directory."""
    inside = [tree for tree in TREES if path.startswith(tree + "/")]
    return max(inside, key=len) if inside else path.split("/")[0]


def uses_of_lab(root):
    """Complaints about uses of the laboratory from outside, sources apart: tests' includes, its targets in CMake."""
    for path in sorted((root / "tests").rglob("*")):
        name = str(path.relative_to(root))
        if path.suffix in (".h", ".cpp") and not name.startswith(LAB_TESTS + "/"):
            for include in re.findall(rf'^#include "((?:{LAB}|{LAB_TESTS})/[^"]+)"', path.read_text(), re.M):
                yield f"{name} includes {include}, of the laboratory: its tests are in {LAB_TESTS}"
    lists = root / LAB / "CMakeLists.txt"
    targets = re.findall(r"^ *add_(?:library|executable)\((\S+)", lists.read_text(), re.M) if lists.exists() else []
    for path in sorted(p for tree in ("core", "haptics", "net", "apps") for p in (root / tree).rglob("CMakeLists.txt")):
        name = str(path.relative_to(root))
        if not name.startswith(LAB + "/"):
            for target in targets:
                if re.search(rf"(?<![\w-]){re.escape(target)}(?![\w-])", re.sub(r"#.*", "", path.read_text())):
                    yield f"{name} names {target}, a target of the laboratory"


def include_names(text):
    """Files that a source includes in quotes, and those of the trees in angle brackets."""
    return re.findall(r'^\s*#\s*include\s*(?:"|<(?=(?:%s)/))([^">]+)[">]' % "|".join(TREES), text, re.M)


def misplaced(name, text):
    """What a file has that belongs in another one."""
    return [f"{name} has {what}, which belongs in {where or 'no file'}" for pattern, where, what in ONE_PLACE
            if re.search(pattern, text) and not re.fullmatch(where, name)]


def io_complaints(root):
    """Sockets and threads in what WITHOUT_IO includes."""
    waiting = sorted(str(p.relative_to(root)) for p in (root / WITHOUT_IO).rglob("*") if p.suffix in ALL_CPP)
    seen = set(waiting)
    while waiting:
        name = waiting.pop()
        text = (root / name).read_text()
        for header in re.findall(IO, text, re.M):
            yield f"{WITHOUT_IO} reaches <{header}> by {name}: it has no sockets and no threads"
        found = {include for include in include_names(text) if (root / include).exists()} - seen
        seen |= found
        waiting += sorted(found)


def tree_complaints(root, tree, listed):
    files = sorted(p for p in (root / tree).rglob("*") if "node_modules" not in p.parts and p.suffix in ALL_CPP and
                   tree_of(str(p.relative_to(root))) == tree)
    used, complaints = {str(p.parent.relative_to(root)) for p in files}, []
    for directory in sorted(used - set(listed)):
        complaints.append(f"{directory} is not in the table of {tree}/README.md")
    for directory in listed:
        if directory not in used:
            complaints.append(f"{tree}/README.md lists {directory}, which has no sources")
    for path in files:
        name, own, text = str(path.relative_to(root)), str(path.parent.relative_to(root)), path.read_text()
        if path.suffix not in (".h", ".cpp") and not (path.suffix == ".c" and own == C_EXAMPLES):
            complaints.append(f"{name}: sources end in .h or .cpp")
        for include in include_names(text):
            other = include.rsplit("/", 1)[0] if "/" in include else include
            other_tree = tree_of(include)
            if other_tree != tree:
                if other_tree not in TREES[tree]:
                    complaints.append(f"{name} includes {include}: {tree} does not include {other_tree}")
            elif other != own and (other not in listed or own not in listed or listed.index(other) > listed.index(own)):
                complaints.append(
                    f"{name} includes {include}: {other} is not above {own} in the table of {tree}/README.md")
        complaints += misplaced(name, text)
    return complaints


def script_imports(source):
    """File → the files that it imports, of a directory of TypeScript; types, too. Names are from that directory."""
    graph = {}
    for path in sorted(source.rglob("*.ts")):
        found = re.findall(r"""(?:\bfrom|\bimport)\s*\(?\s*['"](\.[^'"]+)['"]""", path.read_text(encoding="utf-8"))
        targets = [(path.parent / name).resolve().with_suffix(".ts") for name in found]
        graph[str(path.relative_to(source))] = sorted(
            str(target.relative_to(source.resolve())) for target in targets if target.exists())
    return graph


def directory_graph(graph):
    """The same between directories."""
    directories = {}
    for name, imported in graph.items():
        own = str(pathlib.PurePath(name).parent)
        others = {str(pathlib.PurePath(other).parent) for other in imported} - {own}
        directories.setdefault(own, set()).update(others)
    return {name: sorted(others) for name, others in directories.items()}


def circle(graph):
    """The first circle of a graph, as the list of its nodes; empty where there is none."""
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node):] + [node]
        if node in done:
            return []
        path.append(node)
        for other in graph.get(node, []):
            found = visit(other)
            if found:
                return found
        path.pop()
        done.add(node)
        return []

    for start in sorted(graph):
        found = visit(start)
        if found:
            return found
    return []


def viewer_complaints(root):
    graph = script_imports(root / VIEWER)
    if not graph:
        return [f"{VIEWER} has no TypeScript"]
    return [f"{VIEWER}: {' imports '.join(found)}: a circle"
            for found in (circle(graph), circle(directory_graph(graph))) if found]


def main():
    root = root_of(__doc__)
    order = {tree: table(root, tree) for tree in TREES}
    complaints = [complaint for tree in TREES for complaint in tree_complaints(root, tree, order[tree])]
    complaints += io_complaints(root)
    complaints += uses_of_lab(root)
    complaints += viewer_complaints(root)
    top = {d.split("/")[1] for d in order["core"] if "/" in d}
    if len(top) > MOST_TOP_DIRECTORIES:
        complaints.append(f"core has {len(top)} directories at its top, more than {MOST_TOP_DIRECTORIES}")
    for entry in sorted(p.name for p in root.iterdir()):
        if entry not in TOP_LEVEL and not entry.startswith("."):
            complaints.append(f"unexpected entry at the top: {entry}")
    end("layers", complaints, f"{sum(map(len, order.values()))} directories without a cycle")


if __name__ == "__main__":
    main()
