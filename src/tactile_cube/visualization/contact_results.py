"""The files that an identification or a diagnosis of fingertips and object leaves in its run folder."""

from __future__ import annotations

import json
from pathlib import Path

from tactile_cube.drivetrain.model_file import ModelFile, write_model
from tactile_cube.identification.contact.diagnosis import ContactDiagnosis
from tactile_cube.identification.contact.identification import ContactIdentification
from tactile_cube.identification.in_words import answer, staircase
from tactile_cube.visualization.contact_report import contact_diagnosis_report, contact_report
from tactile_cube.visualization.report import write_report


def write_contact_results(found: ContactIdentification, model: ModelFile, folder: Path, seconds: float) -> None:
    """Write model.yaml, identification.json and report.html, and print the staircase of errors."""
    write_model(model, folder / "model.yaml")
    contact = found.as_json()
    result = {key: contact[key] for key in ("error", "joints", "held_out")}
    result |= {"model": model.model_dump(), "contact": contact, "seconds": round(seconds, 2)}
    (folder / "identification.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    path = str(folder / "model.yaml")
    page = contact_report(found, model.rig, model.provenance.command, path)
    write_report(page, folder / "report.html")
    print(staircase(contact["error"], model))
    for parameter in contact["silent"]:
        print(f"warning: {parameter}: no trial shows it; its interval is the whole range that was searched")
    print(f"model: {path}\nreport: {folder / 'report.html'}")


def write_contact_diagnosis(found: ContactDiagnosis, model: ModelFile, folder: Path, seconds: float) -> None:
    """Write model.yaml, diagnosis.json and report.html, and print the answer."""
    write_model(model, folder / "model.yaml")
    news = {one.effect for one in found.effects()}
    known = [one.effect for one in model.effects if one.effect not in news]
    result = found.as_json() | {"known_effects": known, "seconds": round(seconds, 2)}
    (folder / "diagnosis.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
    path, made = str(folder / "model.yaml"), model.provenance
    page = contact_diagnosis_report(result, model.rig, made.command, made.recording, path)
    write_report(page, folder / "report.html")
    print(answer(result, None))
    print(f"report: {folder / 'report.html'}")
    print(f"model: {folder / 'model.yaml'}\ndiagnosis: {folder / 'diagnosis.json'}")
