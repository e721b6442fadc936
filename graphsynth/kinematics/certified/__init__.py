"""Certificates: statements on poses, motions and turns that are proved in ball arithmetic.

This file loads nothing: every name is resolved on first use.
"""

from __future__ import annotations

from typing import Any

from graphsynth.lazy import resolve

_PUBLIC: dict[str, str] = {
    "AssemblyCertificate": "assembly_modes",
    "AssemblyCertificateBatch": "modes_batch",
    "AssemblyVerdict": "assembly_modes",
    "CrankCertificate": "four_bar",
    "FullTurnCertificate": "full_turn",
    "ModeEnclosure": "assembly_modes",
    "MotionCertificate": "poses",
    "TurnVerdict": "full_turn",
    "Verdict": "poses",
    "certify": "poses",
    "certify_assembly_modes": "assembly_modes",
    "certify_assembly_modes_batch": "modes_batch",
    "certify_direct": "assembly_modes",
    "certify_direct_batch": "modes_batch",
    "certify_four_bar": "four_bar",
    "certify_full_turn": "full_turn",
    "certify_inverted_slider_crank": "four_bar",
    "certify_slider_crank": "four_bar",
}

__all__ = sorted(_PUBLIC)


def __getattr__(name: str) -> Any:
    return resolve(__name__, _PUBLIC, name)
