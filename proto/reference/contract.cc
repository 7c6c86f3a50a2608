#include "proto/reference/contract.h"

#include <google/protobuf/descriptor.pb.h>

#include <cstdlib>
#include <fstream>
#include <iostream>

#include "sixpoint/access/v1/access.pb.h"

namespace sixpoint::reference {

using google::protobuf::DescriptorPool;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using google::protobuf::MethodOptions;

std::vector<const FileDescriptor*> ReadContract(const std::string& file, DescriptorPool* pool) {
  std::ifstream in(file, std::ios::binary);
  google::protobuf::FileDescriptorSet contract;
  std::vector<const FileDescriptor*> ours;
  if (!contract.ParseFromIstream(&in)) {
    std::cerr << file << ": not a contract\n";
    std::exit(1);
  }
  for (const auto& proto : contract.file()) {
    const FileDescriptor* const built = pool->BuildFile(proto);
    if (built != nullptr && built->package().rfind("sixpoint.", 0) == 0) ours.push_back(built);
  }
  return ours;
}

std::string CommentOf(const google::protobuf::SourceLocation& at) {
  std::string text;
  for (const char c : at.leading_comments + at.trailing_comments) {
    const bool is_blank = c == ' ' || c == '\n';
    if (!is_blank) text += c;
    if (is_blank && !text.empty() && text.back() != ' ') text += ' ';
  }
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

std::string WhoMayCall(const MethodDescriptor& method) {
  // The pool is the file's, its options are known by this program's.
  MethodOptions options;
  options.ParseFromString(method.options().SerializeAsString());
  const access::v1::Rule& rule = options.GetExtension(access::v1::rule);
  if (rule.anybody()) return "anybody";
  std::string roles;
  for (const int role : rule.roles())
    roles += (roles.empty() ? "" : ", ") + access::v1::Role_Name(static_cast<access::v1::Role>(role)).substr(5);
  return roles;
}

bool IsWithoutSideEffects(const MethodDescriptor& method) {
  return method.options().idempotency_level() == MethodOptions::NO_SIDE_EFFECTS;
}

}  // namespace sixpoint::reference
