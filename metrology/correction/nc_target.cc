#include "metrology/correction/nc_target.h"

#include <algorithm>

#include "refusal/refusal.h"

namespace sixpoint::metrology {

NcPaths PathsOf(const std::map<std::string, NcTarget>& targets) {
  NcPaths paths;
  for (const auto& [name, target] : targets)
    if (target.number != 0) ++paths[target.path];
  return paths;
}

absl::Status CheckPaths(const std::map<std::string, NcTarget>& targets) {
  const NcPaths paths = PathsOf(targets);
  for (const auto& [name, target] : targets) {
    if (target.number == 0) {
      if (paths.count(name.substr(0, name.find('/'))) > 0)
        return Refuse("targets[" + name + "]", name, "a group that is not called as a path");
      continue;
    }
    const std::string own = target.path + "/" + std::to_string(target.number);
    if (name != own) return Refuse("targets[" + name + "]", own, "a pose under its own name");
    const int count = paths.at(target.path);
    if (target.number < 1 || target.number > count)
      return Refuse("targets[" + name + "].number", target.number, "1 to " + std::to_string(count) + " without a gap");
  }
  return absl::OkStatus();
}

}  // namespace sixpoint::metrology
