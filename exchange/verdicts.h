// The verdict in the words of other systems: one table, both ways (docs/exchange.md, verdicts).
#pragma once

#include <optional>
#include <string_view>

#include "exchange/inspected_part.h"

namespace sixpoint::exchange {

// As our contract has it, without its prefix: CONFORM, NOT_CONFORM, UNDECIDABLE, NOT_MEASURED.
std::string_view VerdictName(Verdict verdict);
std::optional<Verdict> VerdictNamed(std::string_view name);

// CharacteristicStatusEnum of QIF 3.0. MTConnect's CharacteristicStatus has the same words for what we say.
std::string_view QifStatus(Verdict verdict);
// Of others' statuses, too. REWORK is not conform. None where a status says nothing of the part: SYSERROR, UNDEFINED, BASIC_OR_TED.
std::optional<Verdict> VerdictOfQifStatus(std::string_view status);

// InspectionStatusEnum of QIF 3.0, of a whole part.
std::string_view QifInspectionStatus(Verdict verdict);
// None of what says nothing: SYSERROR, UNDEFINED, NOT_CALCULATED.
std::optional<Verdict> VerdictOfQifInspectionStatus(std::string_view status);

// position, inclination, profile, other.
std::string_view KindName(Characteristic::Kind kind);
std::optional<Characteristic::Kind> KindNamed(std::string_view name);

}  // namespace sixpoint::exchange
