#!/usr/bin/env python3
"""scripts/ci/check_budget.py sees what it is there to see; and the repository has none of it.

usage: tests/scripts/budget_test.py
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/ci"))
import check_budget  # pylint: disable=wrong-import-position

NUMBERS = ["constexpr std::size_t kMost = 900;", "static constexpr double kMost{0.43};",
           "inline constexpr int kMost = -3;",
           "constexpr std::size_t kPoints = Tissue::kBlockSize, kMost = 7;", "constexpr float kMost =\n    .05F;",
           "constexpr std::array kMost = {1.5, 2.5};", "constexpr double kMost[2] = {1, 2};",
           "constexpr auto kMost = std::uint64_t{4'000'000};", "constexpr double kMost = 2 * kOther;"]
NOTHING = ["constexpr std::size_t kMost = Tissue::kBlockSize;", "// constexpr int kMost = 7;",
           "if constexpr (kRows == 1) f(2);", "constexpr int most() { return 7; }", "int most = 7;",
           'constexpr const char* kMost = "7 = 7";',
           "constexpr double kMost = std::numeric_limits<double>::infinity();"]


class Numbers(unittest.TestCase):
    def test_every_way_to_write_one_is_seen(self):
        for text in NUMBERS:
            with self.subTest(text):
                self.assertEqual([name for name, _ in check_budget.numbers(text)], ["kMost"])
        for text in NOTHING:
            with self.subTest(text):
                self.assertEqual(list(check_budget.numbers(text)), [])

    def test_a_number_that_no_table_has_is_reported_with_its_line_and_a_name_that_is_gone_too(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "core/needle/cut_path.h"
            source.parent.mkdir(parents=True)
            source.write_text("// text\n\nconstexpr int kMostNeedles = 7;\n", encoding="utf-8")
            found = list(check_budget.complaints_of(pathlib.Path(folder)))
        self.assertTrue(found[0].startswith("core/needle/cut_path.h:3: kMostNeedles "), found[0])
        self.assertIn("core/base/work_budget.h", found[0])
        self.assertIn("core/needle/cut_path.h has no number kResolution", "\n".join(found))


class Repository(unittest.TestCase):
    def test_has_no_tuned_number_elsewhere(self):
        line = [sys.executable, str(ROOT / "scripts/ci/check_budget.py")]
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
