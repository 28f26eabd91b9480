"""Files around the code agree with each other and with what exists: version, workflows, templates, CONTRIBUTING.md."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))
CHANGELOG = (ROOT / "CHANGELOG.md").read_text()

HEADING = re.compile(r"^## (\d+\.\d+\.\d+) - (\d{4}-\d\d-\d\d)$", re.M)
KINDS = {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}
FOLDERS = ("bisplat", "scenes", "simulate", "learn", "tests", "benchmarks", "docs", ".github")


def commands(workflow: Path) -> str:
    """What the steps of a workflow run, one command a line."""
    jobs: dict[str, Any] = yaml.safe_load(workflow.read_text())["jobs"]
    return "\n".join(step["run"] for job in jobs.values() for step in job["steps"] if "run" in step)


def test_version_and_date_are_the_same_everywhere():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    released = HEADING.findall(CHANGELOG)
    assert released[0] == (PROJECT["version"], citation["date-released"].isoformat())
    assert citation["version"] == PROJECT["version"] and citation["license"] == PROJECT["license"]
    assert released == sorted(released, key=lambda each: [*map(int, each[0].split("."))], reverse=True)


def test_changelog_has_known_headings_and_short_lines():
    headings = re.findall(r"^##? .*$", CHANGELOG, re.M)
    assert all(each in ("# Changelog", "## Unreleased") or HEADING.match(each) for each in headings)
    assert set(re.findall(r"^### (.*)$", CHANGELOG, re.M)) <= KINDS
    assert not [line for line in CHANGELOG.splitlines() if len(line) > 120]


@pytest.mark.parametrize("workflow", WORKFLOWS, ids=lambda path: path.name)
def test_workflow_names_what_exists(workflow):
    run, text = commands(workflow), workflow.read_text()
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))
    assert set(re.findall(r"\bmake ([\w-]+)", run)) <= targets
    extras = {extra for found in re.findall(r"\[([\w,-]+)\]['\"]?(?:\s|$)", run) for extra in found.split(",")}
    assert extras <= PROJECT["optional-dependencies"].keys()
    files = set(re.findall(r"(?<![\w/.-])[\w/.-]+\.(?:txt|toml|py)\b", text))
    assert not {name for name in files if not (ROOT / name).exists()}
    modules = re.findall(r"python -m ((?:bisplat|scenes|simulate|learn)[\w.]*)", run)
    assert all((ROOT / f"{module.replace('.', '/')}.py").is_file() for module in modules)
    uses = re.findall(r"uses: (\S+)", text)
    assert uses and all(re.fullmatch(r"[\w-]+/[\w-]+@(v\d+|release/v\d+)", each) for each in uses)


def test_workflows_cover_the_oldest_python():
    tests = yaml.safe_load((ROOT / ".github" / "workflows" / "tests.yml").read_text())
    pythons = tests["jobs"]["test"]["strategy"]["matrix"]["python"]
    assert PROJECT["requires-python"] == f">={pythons[0]}"


def test_contributing_names_what_exists():
    text = (ROOT / "CONTRIBUTING.md").read_text()
    new = set(re.findall(r"```python\n# (\S+)\n\"\"\"", text))  # whole files, which the reader makes
    pattern = rf"(?<![\w/.-])(?:{'|'.join(map(re.escape, FOLDERS))})/[\w/.-]*\w|`[\w.-]+\.(?:md|toml|cff|txt|yaml)`"
    named = {name.strip("`") for name in re.findall(pattern, text)}
    assert len(named) > 20
    theirs = {"scene.yaml"}
    assert not {name for name in named - new - theirs if not (ROOT / name).exists()}
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.M))
    assert set(re.findall(r"[`\n]make ([\w-]+)", text)) <= targets


def test_templates_and_hooks_are_read():
    for path in (ROOT / ".github" / "ISSUE_TEMPLATE").glob("*.yml"):
        form = yaml.safe_load(path.read_text())
        if path.name != "config.yml":
            assert form["name"] and form["description"]
            identifiers = [field["id"] for field in form["body"]]
            assert len(identifiers) == len(set(identifiers)) > 1
            assert all(field["attributes"]["label"] for field in form["body"])
    (local,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())["repos"]
    assert {hook["language"] for hook in local["hooks"]} == {"system"}
    programs = [found for hook in local["hooks"] for found in re.findall(r"-m (benchmarks[\w.]+)", hook["entry"])]
    assert programs and all((ROOT / f"{program.replace('.', '/')}.py").is_file() for program in programs)
