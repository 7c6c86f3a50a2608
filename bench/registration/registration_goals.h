// What registration promises, and how its benchmark measures it.
#pragma once

#include <vector>

#include "bench/goals.h"

namespace sixpoint::bench {

std::vector<Goal> RegistrationGoals();

}  // namespace sixpoint::bench
