// The names that a rule's path (sixpoint/access/v1) stands for in a request.
#pragma once

#include <google/protobuf/message.h>

#include <string>
#include <vector>

namespace sixpoint::runtime {

// What stands under the path (scans, register.scans, requests.blade), whatever on its way is repeated; of a single text that is not set "". False: there
// is no such text in such a message.
bool NamesAt(const google::protobuf::Message& request, const std::string& path, std::vector<std::string>* names);

}  // namespace sixpoint::runtime
