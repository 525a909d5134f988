"""Builds the package's wheel with Python's standard library alone (PEP 517), so that pip needs no network.

It is pure Python. Where BRACHYD_ENGINE names a folder with the engine's module for this Python, as CMake builds it in
build/release/python, the module goes into the wheel, which then is for this Python and machine.
"""
import base64
import hashlib
import os
import pathlib
import sys
import sysconfig
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
NAME, VERSION = "brachyd", "0.1.0"
INFO = f"{NAME}-{VERSION}.dist-info"
METADATA = f"""Metadata-Version: 2.1
Name: {NAME}
Version: {VERSION}
Summary: brachyd, the brachytherapy simulator: client of the daemon, and the engine in process
Requires-Python: >=3.9
Requires-Dist: numpy>=1.21
"""


def engine_module():
    """The module's file that BRACHYD_ENGINE names, or None. A folder without it is an error, not a smaller package."""
    folder = os.environ.get("BRACHYD_ENGINE")
    if not folder:
        return None
    path = pathlib.Path(folder) / f"brachyd_engine{sysconfig.get_config_var('EXT_SUFFIX')}"
    if not path.is_file():
        sys.exit(f"BRACHYD_ENGINE: {path} does not exist; build it by scripts/build.sh release brachyd_engine")
    return path


def tag_of(engine):
    if engine is None:
        return "py3-none-any"
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    return f"{python}-{python}-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def get_requires_for_build_wheel(config_settings=None):
    return []


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    files = {f"{NAME}/{path.name}": path.read_bytes() for path in sorted((HERE / NAME).iterdir()) if path.is_file()}
    engine = engine_module()
    tag = tag_of(engine)
    if engine is not None:
        files[f"{NAME}/{engine.name}"] = engine.read_bytes()
    files[f"{INFO}/METADATA"] = METADATA.encode()
    pure = str(engine is None).lower()
    files[f"{INFO}/WHEEL"] = (f"Wheel-Version: 1.0\nGenerator: build_wheel\nRoot-Is-Purelib: {pure}\n"
                              f"Tag: {tag}\n").encode()
    record = ""
    for path, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{path},sha256={digest},{len(data)}\n"
    files[f"{INFO}/RECORD"] = (record + f"{INFO}/RECORD,,\n").encode()
    wheel = f"{NAME}-{VERSION}-{tag}.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files.items():
            archive.writestr(zipfile.ZipInfo(path, (2020, 1, 1, 0, 0, 0)), data)
    return wheel
