"""Asks evo for its statistics: ask.py CASES FOLDER < nothing, JSON to stdout.

CASES is a JSON file with a list of cases (see tests/data/trajectory/README.md), FOLDER holds their files. evo is run
as a program, as its users run it; nothing of it is imported.
"""

import json
import pathlib
import subprocess
import sys
import tempfile
import zipfile

UNITS = {"frames": "f", "metres": "m", "degrees": "d"}
ALIGNMENTS = {"none": [], "se3": ["--align"], "sim3": ["--align", "--correct_scale"], "origin": ["--align_origin"]}
RELATIONS = {"translation": "trans_part", "rotation": "angle_deg"}


def command(case, folder):
    program = "evo_ape" if case["delta"] is None else "evo_rpe"
    line = [
        str(pathlib.Path(sys.executable).parent / program),
        case["format"],
        str(folder / case["reference"]),
        str(folder / case["estimate"]),
        "--pose_relation",
        RELATIONS[case["of"]],
        *ALIGNMENTS[case["alignment"]],
    ]
    if case["delta"] is not None:
        value, unit = case["delta"]["value"], case["delta"]["unit"]
        if unit == "seconds":
            # evo has no seconds: frames of an even period are the same.
            value, unit = round(value / case["period_s"]), "frames"
        line += ["--delta", str(value), "--delta_unit", UNITS[unit]]
        line += ["--all_pairs"] if case["pairs"] == "all" else []
        line += ["--pairs_from_reference"] if case["pairs_from"] == "reference" else []
    return line


def statistics(case, folder):
    with tempfile.TemporaryDirectory() as scratch:
        results = pathlib.Path(scratch) / "results.zip"
        line = [*command(case, folder), "--no_warnings", "--save_results", str(results)]
        run = subprocess.run(line, capture_output=True, text=True, stdin=subprocess.DEVNULL)
        if run.returncode != 0 or not results.exists():
            raise SystemExit(f"{' '.join(line)}\n{run.stdout}{run.stderr}")
        with zipfile.ZipFile(results) as archive:
            found = json.loads(archive.read("stats.json"))
    return {name: found[name] for name in ("rmse", "mean", "median", "std", "min", "max")}


def main():
    cases, folder = sys.argv[1:]
    cases = json.loads(pathlib.Path(cases).read_text())
    folder = pathlib.Path(folder)
    for case in cases:
        case["statistics"] = statistics(case, folder)
    json.dump(cases, sys.stdout, indent=1)
    print()


main()
