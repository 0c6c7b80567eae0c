"""The pages of the input files, made from their schemas: every key with type, unit, default, rule and meaning."""

from __future__ import annotations

import re
from typing import Any

from trainmj.assessment.file import AssessmentFile
from trainmj.identification.file import TargetsFile
from trainmj.reliability.file import ReliabilityFile
from trainmj.scenario import schema as scenario_schema
from trainmj.scenario.partners import PartnerFile
from trainmj.scenario.parts import Parts
from trainmj.study.file import StudyFile
from trainmj.sweep.file import SweepFile
from trainmj.units import unit_of

Schema = dict[str, Any]

_INTRODUCTION = """# {title}

{text} This page is made from the schema that checks the file. Other keys are refused. If several keys must agree, the
message about a mistake says so, with line, value and rule.
"""


def scenario_page() -> str:
    """Keys of a scenario file."""
    schema = Parts.model_json_schema(by_alias=True)
    schema["properties"] = {"builds_on": scenario_schema()["properties"]["builds_on"]} | schema["properties"]
    text = "What collides, and how it is computed; explained in [Scenarios](../scenario-files.md)."
    return _page("Scenario file", text, schema)


def sweep_page() -> str:
    """Keys of a sweep file."""
    return _page("Sweep file", "Many cases of a scenario; explained in [Sweeps](../sweeps.md).", _schema(SweepFile))


def study_page() -> str:
    """Keys of a study file."""
    text = "From factors to a checked optimum; explained in [Studies](../studies.md)."
    return _page("Study file", text, _schema(StudyFile))


def targets_page() -> str:
    """Keys of a targets file."""
    text = "What `trainmj identify` finds from which data; explained in [Identification](../identification.md)."
    return _page("Targets file", text, _schema(TargetsFile))


def assessment_page() -> str:
    """Keys of an assessment file."""
    text = "What `trainmj assess` asks of a train; explained in [Assessments](../assessments.md)."
    return _page("Assessment file", text, _schema(AssessmentFile))


def partner_page() -> str:
    """Keys of a partner file."""
    text = "What any train can be run into; explained in [Scenarios](../scenario-files.md#partners)."
    return _page("Partner file", text, _schema(PartnerFile))


def reliability_page() -> str:
    """Keys of a reliability file."""
    text = "What `trainmj reliability` draws and asks; explained in [Reliability](../reliability.md)."
    return _page("Reliability file", text, _schema(ReliabilityFile))


def _schema(model: Any) -> Schema:
    return dict(model.model_json_schema(by_alias=True))


def _page(title: str, text: str, schema: Schema) -> str:
    groups = [("The file", schema), *_in_order(schema)]
    parts = [_INTRODUCTION.format(title=title, text=text)]
    for name, group in groups:
        parts += [f"## {_words(name)}", "" if group is schema else group.get("description", ""), _table(group, schema)]
    return "\n\n".join(parts) + "\n"


def _in_order(schema: Schema) -> list[tuple[str, Schema]]:
    """The groups in the order in which the file first mentions them."""
    found: dict[str, Schema] = {}

    def visit(part: Any) -> None:
        for name in re.findall(r"'#/\$defs/(\w+)'", str(part.get("properties", {}))):
            if name not in found:
                found[name] = schema["$defs"][name]
                visit(found[name])

    visit(schema)
    return list(found.items())


def _table(group: Schema, schema: Schema) -> str:
    rows = ["| key | type | unit | default | rule | meaning |", "|---|---|---|---|---|---|"]
    required = group.get("required", [])
    kind_first = sorted(group["properties"].items(), key=lambda item: "const" not in item[1])
    for key, field in kind_first:
        default = "**required**" if key in required else _default(field)
        cells = [f"`{key}`", _type(field), unit_of(key), default, _rule(field), _meaning(field, schema)]
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def _choices(field: Schema) -> list[Schema]:
    """The types a field may have, without the null of an optional one."""
    inner = field.get("anyOf") or field.get("oneOf")
    if inner is None:
        return [field]
    return [choice for part in inner if part.get("type") != "null" for choice in _choices(part)]


def _type(field: Schema) -> str:
    return " or ".join(dict.fromkeys(_one_type(choice) for choice in _choices(field)))


def _one_type(field: Schema) -> str:
    if "$ref" in field:
        name = field["$ref"].rpartition("/")[2]
        return f"[{_words(name)}](#{_words(name).replace(' ', '-')})"
    if "enum" in field:
        return ", ".join(f"`{value}`" for value in field["enum"])
    if "const" in field:
        return f"`{field['const']}`"
    match field.get("type"):
        case "array":
            items = _type(field.get("items") or {})
            if items == "any value":
                return "list"
            return f"list of ({items})" if " or " in items or ":" in items else f"list of {_plural(items)}"
        case "object":
            named = field.get("additionalProperties") or next(iter(field.get("patternProperties", {}).values()), None)
            return f"by name: {_type(named)}" if isinstance(named, dict) else "by name: any value"
        case "string":
            return "text"
        case "integer":
            return "whole number"
        case "number":
            return "number"
        case "boolean":
            return "true or false"
    return "any value"


def _plural(type_: str) -> str:
    return f"{type_}s" if type_ in ("number", "whole number") else type_


def _rule(field: Schema) -> str:
    return "; ".join(dict.fromkeys(rule for choice in _choices(field) for rule in _rules(choice)))


def _rules(field: Schema, each: str = "") -> list[str]:
    rules = []
    signs = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}
    limits = {key: field[key] for key in signs if key in field}
    if "exclusiveMinimum" in limits and limits.get("minimum", 0) <= limits["exclusiveMinimum"]:
        limits.pop("minimum", None)
    rules += [f"{each}{signs[key]} {value:g}" for key, value in limits.items() if abs(value) < 1e100]
    sizes = {"minItems": "at least", "maxItems": "at most", "minProperties": "at least", "maxProperties": "at most"}
    if field.get("minItems") == field.get("maxItems") is not None:
        rules.append(f"{field['minItems']} entries")
    else:
        rules += [f"{words} {field[key]}" for key, words in sizes.items() if key in field]
    if "maxLength" in field:
        rules.append(f"{each}at most {field['maxLength']} characters")
    if "patternErrorMessage" in field:
        rules.append(f"{each}{field['patternErrorMessage'].removeprefix('must be ')}")
    elif "pattern" in field:
        rules.append(f"{each}{_pattern(field['pattern'])}")
    if isinstance(field.get("items"), dict):
        rules += [rule for choice in _choices(field["items"]) for rule in _rules(choice, "each ")]
    names = field.get("propertyNames") or {}
    rules += [f"names: {_pattern(p)}" for p in [names.get("pattern"), *field.get("patternProperties", {})] if p]
    return rules


def _pattern(pattern: str) -> str:
    """A pattern in words, as far as these files have them."""
    first, _, rest = pattern.strip("^$").partition("][")
    letters = {"A-Za-z_": "a letter or _", "A-Za-z": "a letter", "A-Za-z0-9": "a letter or digit"}
    start = letters.get(first.strip("["))
    return f"{start} first, then letters, digits and _" if start and rest == "A-Za-z0-9_]*" else f"matches `{pattern}`"


def _default(field: Schema) -> str:
    value = field.get("default")
    if isinstance(value, dict):  # of a group with several kinds: the kind
        value = value.get("kind", value.get("method"))
    if value is None or value in ("", []):
        return ""
    values = value if isinstance(value, list) else [value]
    return f"`{', '.join(f'{v:g}' if isinstance(v, float) else str(v) for v in values)}`"


def _meaning(field: Schema, schema: Schema) -> str:
    """What a key means; the unit has a column of its own."""
    said = next((c["description"] for c in [field, *_choices(field)] if "description" in c), "")
    refs = [c["$ref"].rpartition("/")[2] for c in _choices(field) if "$ref" in c]
    if not said and refs:
        said = schema["$defs"][refs[0]].get("description", "")
    return re.sub(r" \[[^]]*\]", "", said).split("\n\n")[0].replace("*", "\\*")


def _words(name: str) -> str:
    """The heading of a group: DeviceSpec is a device."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", re.sub(r"(Spec|Part)$", "", name)).lower()
    return words if name != "The file" else name
