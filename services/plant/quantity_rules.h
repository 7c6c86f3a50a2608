// What each quantity of a drawing's characteristics needs and takes.
#pragma once

#include <string>
#include <vector>

namespace sixpoint::plant {

struct QuantityRule {
  enum class Place { kHoles, kHolePair, kSurface, kSection, kAnywhere };
  enum class Zone { kNone, kRound, kWide };
  enum class Datums { kNeeded, kNone, kEither };
  enum class Figures {
    kOfValue,        // nominal and limits, of any sign
    kNeverNegative,  // the same, from 0 on
    kOffNominal,     // limits alone: the CAD is the nominal
    kUpperAlone      // one limit: 0 is best
  };

  const char* quantity;
  Place place;
  std::vector<const char*> units;
  Zone zone;
  Datums datums;
  Figures figures;
  std::vector<const char*> algorithms = {};  // none: there is one
  double greatest = 0;                       // of its figures; 0: as the unit says
};

// Of a word that the contract knows.
const QuantityRule& RuleOf(const std::string& quantity);
// The greatest magnitude of a figure in this unit.
double GreatestIn(const std::string& unit);

}  // namespace sixpoint::plant
