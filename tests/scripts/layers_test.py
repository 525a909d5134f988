#!/usr/bin/env python3
"""scripts/ci/check_layers.py sees what it is there to see; and the repository has none of it.

usage: tests/scripts/layers_test.py
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/ci"))
import check_layers  # pylint: disable=wrong-import-position

THREADS = ["std::jthread feed_;", "std::thread{f}", "std::thread(f)", "std::vector<std::jthread> threads;",
           "std::optional<std::thread> t;", "auto made = std::async(f);", "pthread_create(&t, 0, f, 0);",
           "std::sort(std::execution::par, a, b);", "asio::thread_pool pool{1};", "boost::asio::thread_pool pool;",
           "std::optional<asio::thread_pool> handshakes_;", "#include <boost/asio/thread_pool.hpp>",
           "#pragma omp parallel for", "# pragma omp parallel"]
LOCKS = ["std::mutex m;", "std::timed_mutex m;", "std::recursive_timed_mutex m;", "std::shared_timed_mutex m;",
         "std::condition_variable_any c;", "std::counting_semaphore<1> s{0};", "std::binary_semaphore s{0};",
         "std::latch l{2};", "std::barrier b{2};", "std::call_once(flag, f);", "pthread_mutex_lock(&m);",
         "#include <shared_mutex>"]
ATOMICS = ["std::atomic<int> n;", "std::atomic_ref n{i};", "std::atomic_flag f;", "#include <atomic>",
           "__atomic_load_n(&n, 0);", "__sync_synchronize();"]
CORE, NET = "core", "net"  # of files that only these tests have
NOTHING = ["std::thread::hardware_concurrency()", "std::this_thread::sleep_for(1s);", "// the thread that reads",
           "std::promise<bool> taken;", "int latch = 1;", "std::stop_token stop"]


class Patterns(unittest.TestCase):
    def test_every_way_to_make_threads_locks_and_atomics_is_seen_in_any_directory_of_core(self):
        directories = check_layers.table(ROOT, "core")
        self.assertGreater(len(directories), 30)
        for directory in directories:
            name = f"{directory}/new_file.cpp"
            for line in THREADS + LOCKS + ATOMICS:
                with self.subTest(name, line=line):
                    self.assertEqual(len(check_layers.misplaced(name, f"void f() {{\n{line}\n")), 1)
            for line in NOTHING:
                with self.subTest(name, line=line):
                    self.assertEqual(check_layers.misplaced(name, line), [])

    def test_pools_belong_to_the_event_loop_and_the_relay(self):
        for name in ("apps/daemon/io/event_loop.cpp", "apps/brachy/live/relay.cpp"):
            self.assertEqual(check_layers.misplaced(name, "asio::thread_pool pool{1};"), [])
        self.assertEqual(len(check_layers.misplaced("net/server/server.cpp", "asio::thread_pool pool{1};")), 1)

    def test_includes_are_read_however_they_are_written(self):
        text = f'#include "{CORE}/a.h"\n  #include "{NET}/b.h"\n#  include <{NET}/c.h>\n#include <vector>\n'
        self.assertEqual(check_layers.include_names(text), [f"{CORE}/a.h", f"{NET}/b.h", f"{NET}/c.h"])


class Repository(unittest.TestCase):
    def test_has_no_breach(self):
        line = [sys.executable, str(ROOT / "scripts/ci/check_layers.py")]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))


class Trees(unittest.TestCase):
    def complaints(self, files):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in files.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            return check_layers.tree_complaints(root, "core", ["core/base", "core/needle"])

    def test_files_of_any_ending_and_of_directories_that_no_table_lists_are_seen(self):
        good = {f"{CORE}/base/a.h": "", f"{CORE}/needle/b.cpp": f'#include "{CORE}/base/a.h"\n'}
        self.assertEqual(self.complaints(good), [])
        for files, words in ((good | {f"{CORE}/new/c.cpp": ""}, f"{CORE}/new is not in the table"),
                             (good | {f"{CORE}/d.cpp": ""}, "core is not in the table"),
                             (good | {f"{CORE}/base/e.hpp": ""}, "e.hpp: sources end in"),
                             (good | {f"{CORE}/base/e.c": ""}, "e.c: sources end in"),
                             (good | {f"{CORE}/base/f.h": f'#include "{CORE}/needle/b.h"\n'}, "is not above"),
                             (good | {f"{CORE}/base/g.cpp": f"#include <{NET}/x.h>\n"}, "does not include net"),
                             (good | {f"{CORE}/base/h.inc": "asio::thread_pool pool;\n"}, "a pool of threads")):
            with self.subTest(words):
                self.assertIn(words, "\n".join(self.complaints(files)))


class Requests(unittest.TestCase):
    def test_reach_no_socket_by_whatever_they_include(self):
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            for name, text in {f"{NET}/requests/a.cpp": f'#include "{NET}/wire/b.h"\n',
                               f"{NET}/wire/b.h": "#include <map>\n",
                               f"{NET}/wire/c.h": "#include <boost/asio.hpp>\n"}.items():
                (root / name).parent.mkdir(parents=True, exist_ok=True)
                (root / name).write_text(text, encoding="utf-8")
            self.assertEqual(list(check_layers.io_complaints(root)), [])
            (root / NET / "wire/b.h").write_text(f'#include "{NET}/wire/c.h"\n', encoding="utf-8")
            self.assertIn(f"<boost/asio.hpp> by {NET}/wire/c.h", "".join(check_layers.io_complaints(root)))


class Circles(unittest.TestCase):
    def test_one_is_found_wherever_it_begins(self):
        self.assertEqual(check_layers.circle({"a": ["b"], "b": ["c"], "c": []}), [])
        self.assertEqual(check_layers.circle({"a": ["b", "c"], "b": ["d"], "c": ["d"], "d": []}), [])
        self.assertEqual(check_layers.circle({"a": ["b"], "b": ["c"], "c": ["b"]}), ["b", "c", "b"])
        self.assertEqual(check_layers.circle({"a": ["a"]}), ["a", "a"])

    def test_of_typescript_types_and_directories_count(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder)
            for name, text in {"x/a.ts": "import {B} from './b.js';\nimport '../y/c.js';\n",
                               "x/b.ts": "import type {A} from './a.js';\n", "y/c.ts": "",
                               "y/d.ts": "import {\n  A,\n} from \"../x/a.js\";\n"}.items():
                (source / name).parent.mkdir(exist_ok=True)
                (source / name).write_text(text, encoding="utf-8")
            graph = check_layers.script_imports(source)
            self.assertEqual(graph["x/a.ts"], ["x/b.ts", "y/c.ts"])
            self.assertEqual(check_layers.circle(graph), ["x/a.ts", "x/b.ts", "x/a.ts"])
            self.assertEqual(check_layers.circle(check_layers.directory_graph(graph)), ["x", "y", "x"])


if __name__ == "__main__":
    unittest.main()
