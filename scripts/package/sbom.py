#!/usr/bin/env python3
"""Writes the software bill of materials of the packages as SPDX 2.3 (JSON): each package with its checksum, and what it
depends on, by dpkg's list of this machine with exact versions.
    scripts/package/sbom.py PACKAGE.deb… >brachyd.spdx.json"""
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys


def field(deb, name):
    return subprocess.run(["dpkg-deb", "-f", deb, name], check=True, capture_output=True, text=True).stdout.strip()


def installed(name):
    """Version and homepage of a Debian package here; None: it is not installed."""
    query = ["dpkg-query", "-W", "-f=${Version}\t${Homepage}", name]
    done = subprocess.run(query, capture_output=True, text=True, check=False)
    return done.stdout.split("\t") if done.returncode == 0 and done.stdout.strip() else None


def identifier(name):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)


def main(debs):
    if not debs:
        sys.exit(__doc__)
    epoch = int(os.environ.get("SOURCE_DATE_EPOCH") or 0)
    created = datetime.datetime.fromtimestamp(epoch, datetime.timezone.utc).strftime("%Y-%m-%dT%H:%M:%SZ")
    packages, relations = {}, []
    for deb in sorted(debs):
        name, version = field(deb, "Package"), field(deb, "Version")
        packages[name] = {
            "SPDXID": identifier(name),
            "name": name,
            "versionInfo": version,
            "packageFileName": pathlib.Path(deb).name,
            "downloadLocation": "NOASSERTION",
            "licenseDeclared": "Apache-2.0",
            "licenseConcluded": "Apache-2.0",
            "copyrightText": "NOASSERTION",
            "filesAnalyzed": False,
            "checksums": [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(open(deb, "rb").read()).hexdigest()}],
        }
        relations.append(("SPDXRef-DOCUMENT", "DESCRIBES", identifier(name)))
        for needed in filter(None, re.split(r"[,|]", field(deb, "Depends"))):
            other = re.match(r"\s*([a-z0-9.+-]+)", needed)[1]
            here = installed(other)
            if other not in packages:
                packages[other] = {
                    "SPDXID": identifier(other),
                    "name": other,
                    "versionInfo": here[0] if here else "NOASSERTION",
                    "homepage": here[1] if here and here[1] else "NOASSERTION",
                    "downloadLocation": "NOASSERTION",
                    "licenseDeclared": "NOASSERTION",
                    "licenseConcluded": "NOASSERTION",
                    "copyrightText": "NOASSERTION",
                    "filesAnalyzed": False,
                    "supplier": "Organization: Debian",
                }
            relations.append((identifier(name), "DEPENDS_ON", identifier(other)))
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": "brachyd",
        "documentNamespace": "https://example.org/brachyd/"
        + hashlib.sha256("".join(p["SPDXID"] + p["versionInfo"] for p in packages.values()).encode()).hexdigest(),
        "creationInfo": {"created": created, "creators": ["Tool: scripts/package/sbom.py"]},
        "packages": list(packages.values()),
        "relationships": [
            {"spdxElementId": a, "relationshipType": kind, "relatedSpdxElement": b} for a, kind, b in relations
        ],
    }
    print(json.dumps(document, indent=1))


main(sys.argv[1:])
