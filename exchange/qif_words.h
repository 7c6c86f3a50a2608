// Names of ours within QIF documents, for what QIF has no element for: written by qif_write.cc, read by qif_read.cc.
#pragma once

namespace sixpoint::exchange::qif {

inline constexpr char kKind[] = "sixpoint.kind";
inline constexpr char kLower[] = "sixpoint.lower";
inline constexpr char kWorstNegative[] = "sixpoint.worst_negative_deviation_mm";
inline constexpr char kWorstPositive[] = "sixpoint.worst_positive_deviation_mm";
inline constexpr char kResult[] = "sixpoint.result";
inline constexpr char kMachine[] = "sixpoint.machine";
inline constexpr char kMachineRevision[] = "sixpoint.machine_revision";
inline constexpr char kOperation[] = "sixpoint.operation";
inline constexpr char kDecisionRule[] = "sixpoint.decision_rule";
inline constexpr char kMethod[] = "sixpoint.method";
inline constexpr char kRegistration[] = "sixpoint.registration";
inline constexpr char kCalibration[] = "sixpoint.calibration";
inline constexpr char kScan[] = "sixpoint.scan";
inline constexpr char kCharacteristic[] = "sixpoint.characteristic";
inline constexpr char kRatioUnit[] = "ratio";
inline constexpr char kUncertainty[] = "sixpoint.uncertainty";

}  // namespace sixpoint::exchange::qif
