// A period's efficacy as it is answered.
#pragma once

#include "services/inspection/efficacy.h"
#include "sixpoint/inspection/v1/efficacy.pb.h"

namespace sixpoint::inspection {

extern const char* const kEfficacyRule;

// machine_id: that cut. Angles in degrees.
void ToProto(const std::string& machine_id, const PeriodOutcomes& period, const metrology::Efficacy& efficacy,
             v1::EfficacyPeriod* out);
void ToProto(const LeftOutCounts& counts, v1::LeftOut* out);

}  // namespace sixpoint::inspection
