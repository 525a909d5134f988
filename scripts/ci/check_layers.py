#!/usr/bin/env python3
"""Checks who includes whom, against the tables "Directories" in the README.md of core, haptics, net and apps.

A directory includes only directories above it in the table of its tree, and the trees only each other as TREES says.
So the include graph between directories has no cycle. Also what must stay in one file: libraries, threads, atomics,
locks.

usage: scripts/ci/check_layers.py [--root DIR]     exit code 1 and a line for each breach
"""
import argparse
import pathlib
import re
import sys

# A tree includes itself and these.
TREES = {"core": (), "haptics": ("core",), "net": ("core",), "apps": ("core", "haptics", "net")}

# What a pattern matches stays in files whose path matches.
ONE_PLACE = [
    (r"#include <assimp/", r"core/geometry/mesh_io/mesh_file\.cpp", "assimp"),
    (r"#include <CLI/", r"apps/command_line/command_line_parts\.h", "CLI11"),
    (r'#include "apps/command_line/command_line_parts\.h"',
     r"apps/(command_line/[a-z_]*|study/program/study_line)\.cpp", "CLI11's header"),
    (r'#include "apps/study/', r"apps/study/.*", "a source of the study, which no product includes"),
    (r"#include <toml\+\+/", r"core/base/toml_table\.cpp", "tomlplusplus"),
    (r'#include "core/base/toml_table\.h"',
     r"core/(base/toml_table\.cpp|scene/file/.*|"
     r"brachytherapy/(plan/plan_toml|dose/source_toml|hdr/hdr_plan_toml)\.cpp)|apps/score/exercise\.cpp",
     "reading TOML"),
    (r"#include <boost/beast",
     r"net/http/(http_listener\.cpp|websocket_connection\.h)|apps/examples/haply_device\.cpp", "Boost.Beast"),
    (r'#include "net/http/websocket_connection\.h"', r"net/http/http_listener\.cpp", "Boost.Beast's header"),
    (r"#include <nats", r"net/broker/nats_link\.cpp", "libnats"),
    (r"#include <pybind11/", r"apps/python/engine/module\.cpp", "pybind11"),
    (r"#include <(openssl/|boost/asio/ssl)", r"net/(transport/tls|access)/.*", "OpenSSL"),
    (r"#include <atomic>|std::atomic", r"core/realtime/triple_buffer\.h", "atomics"),
    (r"std::j?thread[ ({]|pthread_create|std::async\(",
     r"apps/(daemon/daemon\.(h|cpp)|brachy/live/relay\.cpp)", "creating threads"),
    (r"std::(mutex|condition_variable|shared_mutex|recursive_mutex)",
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
TOP_LEVEL = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "SECURITY.md", "README.md", "apps", "core", "net",
             "haptics", "config", "tests", "scripts", "build", "out"}
MOST_TOP_DIRECTORIES = 13  # of core


def table(root, tree):
    """The directories of a tree from bottom to top, as its README.md lists them."""
    text = (root / tree / "README.md").read_text()
    section = re.search(r"^## Directories\n(.*?)(?=^## |\Z)", text, re.M | re.S)
    if not section:
        sys.exit(f"layers: {tree}/README.md has no section \"## Directories\"")
    return [tree if name == "." else f"{tree}/{name}" for name in re.findall(r"^\| `([^`]+)` \|", section[1], re.M)]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2])
    root = parser.parse_args().root
    complaints = []
    order = {tree: table(root, tree) for tree in TREES}
    for tree in TREES:
        files = sorted(p for p in (root / tree).rglob("*") if p.suffix in (".h", ".cpp"))
        used = {str(p.parent.relative_to(root)) for p in files}
        for directory in sorted(used - set(order[tree])):
            complaints.append(f"{directory} is not in the table of {tree}/README.md")
        for directory in order[tree]:
            if directory not in used:
                complaints.append(f"{tree}/README.md lists {directory}, which has no sources")
        for path in files:
            name = str(path.relative_to(root))
            own = str(path.parent.relative_to(root))
            text = path.read_text()
            for include in re.findall(r'^#include "([^"]+)"', text, re.M):
                other = include.rsplit("/", 1)[0] if "/" in include else include
                other_tree = include.split("/")[0]
                if other_tree != tree:
                    if other_tree not in TREES[tree]:
                        complaints.append(f"{name} includes {include}: {tree} does not include {other_tree}")
                elif other != own and (other not in order[tree] or own not in order[tree] or
                                       order[tree].index(other) > order[tree].index(own)):
                    complaints.append(
                        f"{name} includes {include}: {other} is not above {own} in the table of {tree}/README.md")
            for pattern, where, what in ONE_PLACE:
                if re.search(pattern, text) and not re.fullmatch(where, name):
                    complaints.append(f"{name} has {what}, which belongs in {where or 'no file'}")
    top = {d.split("/")[1] for d in order["core"] if "/" in d}
    if len(top) > MOST_TOP_DIRECTORIES:
        complaints.append(f"core has {len(top)} directories at its top, more than {MOST_TOP_DIRECTORIES}")
    for entry in sorted(p.name for p in root.iterdir()):
        if entry not in TOP_LEVEL and not entry.startswith("."):
            complaints.append(f"unexpected entry at the top: {entry}")
    for complaint in complaints:
        print("layers:", complaint, file=sys.stderr)
    if complaints:
        sys.exit(1)
    print(f"layers: ok, {sum(map(len, order.values()))} directories without a cycle")


if __name__ == "__main__":
    main()
