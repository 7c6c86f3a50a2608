// Certificates, expansions and error sources, as people write them down (docs/examples/machine.yaml, artefact.yaml, part.yaml).
#pragma once

#include "cli/document.h"
#include "sixpoint/plant/v1/machine.pb.h"
#include "sixpoint/plant/v1/reference.pb.h"

namespace sixpoint::cli {

// {number, calibrated_at, expires_at}: days as 2026-11-21, from their beginning in UTC, or moments as 2026-11-21T03:25:01Z.
void ReadCertificate(const Field& certificate, plant::v1::Certificate* out);
// {um_per_m_k, standard_uncertainty_um_per_m_k}.
void ReadThermalExpansion(const Field& expansion, plant::v1::ThermalExpansion* out);
void ReadErrorSources(const Field& sources, plant::v1::ErrorSources* out);
void ReadTouchProbe(const Field& probe, plant::v1::TouchProbe* out);

}  // namespace sixpoint::cli
