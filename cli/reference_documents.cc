#include "cli/reference_documents.h"

#include <google/protobuf/util/time_util.h>

#include <string>

namespace sixpoint::cli {
namespace {

google::protobuf::Timestamp ReadMoment(const Field& moment) {
  constexpr std::size_t kDay = 10;  // 2026-11-21
  std::string text = moment.Text();
  if (text.size() == kDay) text += "T00:00:00Z";
  google::protobuf::Timestamp out;
  if (!google::protobuf::util::TimeUtil::FromString(text, &out))
    moment.Refuse("a day as 2026-11-21, or a moment as 2026-11-21T03:25:01Z");
  return out;
}

}  // namespace

void ReadCertificate(const Field& certificate, plant::v1::Certificate* out) {
  certificate.OnlyKeys({"number", "calibrated_at", "expires_at"});
  out->set_number(certificate.At("number").Text());
  *out->mutable_calibrated_at() = ReadMoment(certificate.At("calibrated_at"));
  *out->mutable_expires_at() = ReadMoment(certificate.At("expires_at"));
}

void ReadThermalExpansion(const Field& expansion, plant::v1::ThermalExpansion* out) {
  expansion.OnlyKeys({"um_per_m_k", "standard_uncertainty_um_per_m_k"});
  out->set_um_per_m_k(expansion.At("um_per_m_k").Number(-5, 50));
  out->set_standard_uncertainty_um_per_m_k(expansion.At("standard_uncertainty_um_per_m_k").Positive(10));
}

void ReadErrorSources(const Field& sources, plant::v1::ErrorSources* out) {
  constexpr double kMostUm = 1000, kMostUmPerM = 10'000;
  sources.OnlyKeys({"approach", "touch_offset_um", "scanner_field_um", "tool_offset_um", "linear_scale_um_per_m",
                    "squareness_um_per_m", "temperature_k", "temperature_half_range_k", "scale_expansion",
                    "encoder_latency_um"});
  if (const auto approach = sources.Find("approach"))
    out->set_approach(approach->Choice({"upwards", "downwards"}) == "upwards" ? plant::v1::APPROACH_UPWARDS
                                                                              : plant::v1::APPROACH_DOWNWARDS);
  if (const auto um = sources.Find("touch_offset_um")) out->set_touch_offset_um(um->Positive(kMostUm));
  if (const auto um = sources.Find("scanner_field_um")) out->set_scanner_field_um(um->Positive(kMostUm));
  if (const auto um = sources.Find("tool_offset_um")) out->set_tool_offset_um(um->Positive(kMostUm));
  if (const auto um = sources.Find("linear_scale_um_per_m")) out->set_linear_scale_um_per_m(um->Positive(kMostUmPerM));
  if (const auto um = sources.Find("squareness_um_per_m")) out->set_squareness_um_per_m(um->Positive(kMostUmPerM));
  if (const auto k = sources.Find("temperature_k")) out->set_temperature_k(k->Positive(10));
  if (const auto k = sources.Find("temperature_half_range_k")) out->set_temperature_half_range_k(k->Positive(30));
  if (const auto scale = sources.Find("scale_expansion")) ReadThermalExpansion(*scale, out->mutable_scale_expansion());
  if (const auto um = sources.Find("encoder_latency_um")) out->set_encoder_latency_um(um->Positive(kMostUm));
}

void ReadTouchProbe(const Field& probe, plant::v1::TouchProbe* out) {
  probe.OnlyKeys({"serial_number", "certificate"});
  out->set_serial_number(probe.At("serial_number").Text());
  if (const auto certificate = probe.Find("certificate")) ReadCertificate(*certificate, out->mutable_certificate());
}

}  // namespace sixpoint::cli
