// How much a measured outline wavers about a smooth one, and over what length.
//
// Section frame, mm. Thread-safe; deterministic.
#pragma once

#include <optional>
#include <vector>

#include "metrology/sections/camber.h"
#include "metrology/sections/outline_fit.h"

namespace sixpoint::metrology {

// One size and length that the waver may have, with its share of the likelihood.
struct FormChoice {
  double sigma_mm = 0, length_mm = 0;  // covariance of places s apart: sigma^2 exp(-s^2 / (2 length^2))
  double share = 0;
};

struct FormError {
  std::vector<FormChoice> choices;  // shares add up to 1; by share, the greatest first
  double sigma_mm = 0;              // root of the mean variance
  double length_mm = 0;             // of the greatest share
  double freedom = 1e6;             // degrees of freedom of that variance
  bool from_nominal = false;
};

// By restricted likelihood of two series along the camber line: half the thickness, and the camber line across itself. With a nominal outline
// they are what the measured one deviates from it on both sides after a best fit, less a line in place each: all wavering shows. Without
// one they are themselves less polynomials of degree 4, and waves longer than about two fifths of the camber line are not told from shape.
FormError FormErrorOf(const FittedOutline& fitted, const Camber& camber, const Outline* nominal);

}  // namespace sixpoint::metrology
