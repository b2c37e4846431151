"""All results as one JSON object, for teachers, with a digest; and a grading as an object and back."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from msgspec import structs

from vrs_cli.teach.exercise import Exercise
from vrs_cli.teach.grading import Grading, VariantMarks, total_of
from vrs_cli.teach.marking import Mark
from vrs_cli.teach.similar import Likeness

FORMAT = "vrs grades 1"
Object = dict[str, Any]


def results_object(exercise: Exercise, gradings: Sequence[Grading], alike: Iterable[Likeness]) -> Object:
    """Return all results, with `digest`: the SHA-256 of the canonical JSON of all the rest."""
    found = {
        "format": FORMAT,
        "exercise": {
            "name": exercise.name,
            "title": exercise.title,
            "points": total_of(exercise),
            "checks": [{"name": one.name, "points": one.points, "hidden": one.hidden} for one in exercise.checks],
            "seeds": list(exercise.seeds),
        },
        "submissions": [_summary(one, exercise) for one in gradings],
        "similar": [{"students": [one.first, one.second], "similarity": one.similarity} for one in alike],
    }
    return found | {"digest": hashlib.sha256(canonical_json(found).encode()).hexdigest()}


def canonical_json(found: Object) -> str:
    """Return JSON with sorted keys, without blanks, in ASCII: the same for equal objects."""
    return json.dumps(found, sort_keys=True, separators=(",", ":"))


def written_json(found: object) -> str:
    """Return JSON as a file has it."""
    return json.dumps(found, indent=2, ensure_ascii=True) + "\n"


def _summary(grading: Grading, exercise: Exercise) -> Object:
    """A submission, with what its marks come to."""
    checks = [{**structs.asdict(found), "seed": seed} for seed, found in grading.marks]
    graded = not grading.lost
    return {
        "student": grading.student,
        "file": grading.file,
        "sha256": grading.sha256,
        "status": "graded" if graded else "not graded",
        "reason": grading.lost or grading.stopped,
        "points": grading.points if graded else None,
        "of": total_of(exercise),
        "marks": checks,
        "variants": grading_object(grading)["variants"],
    }


# --- a grading on its way between processes --------------------------------------------------------------------------


def grading_object(grading: Grading) -> Object:
    """Return a grading as an object of JSON."""
    variants = [
        {**structs.asdict(one), "marks": [structs.asdict(found) for found in one.marks]} for one in grading.variants
    ]
    return structs.asdict(grading) | {"variants": variants}


def grading_from(found: Mapping[str, Any]) -> Grading:
    """Return the grading of an object."""
    variants = tuple(
        VariantMarks(**{**one, "marks": tuple(Mark(**each) for each in one["marks"])}) for one in found["variants"]
    )
    return Grading(**{**found, "variants": variants})
