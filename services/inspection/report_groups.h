// What a report tells characteristic by characteristic: of results as they were judged, or of an assessment.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "report/report.h"
#include "sixpoint/inspection/v1/assessment.pb.h"
#include "sixpoint/inspection/v1/measurement.pb.h"

namespace sixpoint::inspection {

using CharacteristicGroups = std::vector<report::CharacteristicGroup>;

// Positions and inclinations with their verdicts; what was measured besides without one.
void AddGroupsOf(const v1::Inspection& inspection, CharacteristicGroups* groups);
// Its profile tolerances.
void AddGroupsOf(const v1::DeviationMap& map, CharacteristicGroups* groups);
// By hole group, section and region. The drawing is the one that it names; what other results and instruments say stands beside.
CharacteristicGroups GroupsOf(const v1::Assessment& assessment, const plant::v1::Drawing& drawing,
                              const std::vector<v1::Measurement>& measurements);

// "CMM Maker Model, serial number 17".
std::string NameOf(const v1::Instrument& instrument);

// A drawing's characteristics by their balloons' numbers; the drawing lives longer.
using Balloons = std::map<std::string, const plant::v1::Characteristic*>;
Balloons BalloonsOf(const plant::v1::Drawing& drawing);

// drawn: null: the drawing has none of that number.
report::Characteristic CharacteristicOf(const v1::CharacteristicFinding& finding,
                                        const plant::v1::Characteristic* drawn);

}  // namespace sixpoint::inspection
