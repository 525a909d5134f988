#!/usr/bin/env python3
"""scripts/ci/check_shape.py counts members and lines as a reader does; and the repository has none too many.

usage: tests/scripts/shape_test.py
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts/ci"))
import check_shape  # pylint: disable=wrong-import-position

CLASS = """\
class Part : public Base {
 public:
  explicit Part(int a, int b) : a_(a) { b_ = b; }
  bool operator==(const Part&) const = default;
  int size() const {
    int local = 0;
    return local;
  }
  static constexpr int kMost = 7;

 private:
  struct Inner {
    int one = 0, two = 0;
    std::vector<int> three;  // int four;
  };
  using Pairs = std::map<int, std::pair<int, int>>;
  int a_ = std::max(1, 2), b_{3};
  std::map<int, std::pair<int, int>> c_;
  std::array<Inner, 2> d_ = {Inner{1, 2, {}},
                             Inner{}};
  Inner e_;
};
"""


def function(lines):
    body = "  f(1);\n" * (lines - 3)
    return f"void Part::run(int a,\n               int b) {{\n{body}}}\n"


class Shape(unittest.TestCase):
    def test_members_are_counted_without_functions_types_constants_and_those_of_inner_structs(self):
        lines = check_shape.code_of(CLASS)
        self.assertEqual(check_shape.members(lines, 0, ""), 5)
        inner = next(n for n, line in enumerate(lines) if "struct Inner" in line)
        self.assertEqual(check_shape.members(lines, inner, "  "), 3)

    def test_a_function_is_as_long_as_from_its_first_line_to_its_brace(self):
        text = "namespace {\n\nint declared(int a);\n\n" + function(61) + "\n}  // namespace\n" + function(9)
        self.assertEqual([count for _, count in check_shape.functions(check_shape.code_of(text))], [61, 9])

    def test_what_is_too_large_is_reported_with_its_line(self):
        with tempfile.TemporaryDirectory() as folder:
            needle = pathlib.Path(folder) / "core/needle"
            needle.mkdir(parents=True)
            (needle / "long.cpp").write_text("int a;\n\n" + function(61), encoding="utf-8")
            (needle / "short.cpp").write_text(function(60), encoding="utf-8")
            many = "".join(f"  int m{i} = 0;\n" for i in range(16))
            (needle / "wide.h").write_text(f"struct Wide {{\n{many}}};\n", encoding="utf-8")
            complaints = list(check_shape.complaints_of(pathlib.Path(folder)))
        self.assertEqual([complaint.split(": ")[0] for complaint in complaints],
                         [f"core/needle/{name}" for name in ("long.cpp:3", "wide.h:1")])

    def test_the_repository_has_none(self):
        subprocess.run([ROOT / "scripts/ci/check_shape.py"], check=True)


if __name__ == "__main__":
    unittest.main()
