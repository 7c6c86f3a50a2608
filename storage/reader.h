// Who reads: lists and recalls leave out what he may not see (migrations/V0018). Nobody is named: what is everybody's.
#pragma once

#include <string>

namespace sixpoint::storage {

struct Reader {
  std::string identity;   // users/jane, machines/m1
  bool sees_all = false;  // the plant's own work, for nobody

  static Reader Everything() { return {"", true}; }
};

}  // namespace sixpoint::storage
