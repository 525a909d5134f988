#!/usr/bin/env python3
"""The lists of models in the sources, for charts and scripts: the ψ kernels and the matrix-valued models.

usage: kernel_list.py     prints the names of all models, one a line
"""
import re
from pathlib import Path

CORE = Path(__file__).resolve().parents[2] / "core"
COLORS = ("tab:blue", "tab:green", "tab:orange", "tab:red", "tab:olive", "tab:gray", "navy", "teal", "gold", "maroon")


def kernels():
    """{name: label of a chart} of every ψ kernel, in the order in which core/kernels/kernels.h defines them."""
    return dict(re.findall(r'kName = "(\w+)";\s+static constexpr std::string_view kLabel = "([^"]+)"',
                           (CORE / "kernels/kernels.h").read_text()))


def colored_kernels():
    """{name: (label, color)}."""
    return {name: (label, COLORS[i % len(COLORS)]) for i, (name, label) in enumerate(kernels().items())}


def matrix_models():
    """Names of the matrix-valued models, cheapest first."""
    text = (CORE / "models/matrix_kernel/matrix_models.cpp").read_text()
    return re.findall(r'\{"(\w+)"', text[text.index("kMatrixModels[] = {"):].split("};")[0])


if __name__ == "__main__":
    print("\n".join([*kernels(), *matrix_models()]))
