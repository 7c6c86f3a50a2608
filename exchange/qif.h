// Results as QIF 3.0 (ISO 23952): a plan document for each revision of a part, a result document for each inspection. What each element
// holds: docs/exchange.md, qif. A result document holds its characteristics itself, so that a reader needs no other file, under the ids
// and UUIDs that they have in the plan document, and names that by its QPId.
//
// Position and profile are written as ISO 1101 has them, as the width of a zone: twice our distances, and halved as they are read.
// combinedUncertainty is the standard uncertainty, half of our expanded one (k = 2).
#pragma once

#include <absl/status/statusor.h>

#include <string>
#include <string_view>

#include "exchange/inspected_part.h"

namespace sixpoint::exchange {

// A UUID that follows from what it names, RFC 9562 version 8: the 128-bit FNV-1a hash of a kind and its names. The same names give the same
// UUID on any machine; two that differ give the same one only by chance, or by who looks for such names.
// The plan's: of part, revision, and the characteristics with their limits; a part that is judged by others has another plan.
std::string QifPlanId(const InspectedPart& part);
// The QPId of the document that holds a result, "inspections/UUID". The result's own UUID is its ThisResultsInstanceQPId.
std::string QifDocumentId(const std::string& result);
// Of one characteristic, in CharacteristicDesignator: the same in the plan and in all results of that revision.
std::string QifCharacteristicId(const std::string& part, int revision, const std::string& characteristic);

// What the results of one revision's characteristics share, worked out once for as many of them as there are.
class QifPlan {
 public:
  // INVALID_ARGUMENT as Check, where there is no characteristic, and where one is of another kind than ours.
  static absl::StatusOr<QifPlan> Of(const InspectedPart& part);
  // Whether the part is of that revision, judged by the same characteristics with the same limits.
  bool IsOf(const InspectedPart& part) const { return SameCharacteristics(of_, part); }
  const std::string& id() const { return id_; }

  // The characteristics; no value is in it.
  std::string PlanDocument() const;
  // One result of the plan. INVALID_ARGUMENT as Of, where the plan is another's, and where `result` ends with no UUID.
  absl::StatusOr<std::string> ResultDocument(const InspectedPart& part) const;

 private:
  InspectedPart of_;                  // part, revision and characteristics
  std::string id_, characteristics_;  // as both documents have them
};

// Both of one part alone.
absl::StatusOr<std::string> QifPlanOf(const InspectedPart& part);
absl::StatusOr<std::string> ToQif(const InspectedPart& part);

inline constexpr std::size_t kMostQifBytes = 32 << 20;
inline constexpr std::size_t kMostQifCharacteristics = 20000;

// All that ToQif wrote but a profile's points; of others' documents characteristics with their limits, values, statuses, serial number, part, order, operator and
// time. A status that says nothing of a value (UNDEFINED, SYSERROR) becomes undecidable with that reason, never a pass.
// INVALID_ARGUMENT names what cannot be read: a document of another version, without units, with a document type, of several parts, with
// characteristics in another file, or larger than the bounds above.
absl::StatusOr<InspectedPart> FromQif(std::string_view document);

}  // namespace sixpoint::exchange
