// Fails the build where a method of the contract has no rule of who may call it (sixpoint/access/v1), or one that says half.
// usage: sixpoint-check-rules CONTRACT    the descriptor set of the whole contract
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>

#include <algorithm>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "sixpoint/access/v1/access.pb.h"

namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::MethodDescriptor;
using sixpoint::access::v1::Rule;

// "header.machine" in UploadScanRequest; none where there is no such text.
const FieldDescriptor* FieldAt(const Descriptor* message, const std::string& path) {
  std::istringstream names(path);
  const FieldDescriptor* field = nullptr;
  for (std::string name; std::getline(names, name, '.');) {
    if (message == nullptr) return nullptr;
    field = message->FindFieldByName(name);
    if (field == nullptr) return nullptr;
    message = field->message_type();
  }
  return field;
}

bool Has(const google::protobuf::RepeatedPtrField<std::string>& paths, const std::string& path) {
  return std::find(paths.begin(), paths.end(), path) != paths.end();
}

// The texts of a request that are called as what is of a part is: their paths.
void AddOfPart(const Descriptor& message, const std::string& before, int depth, std::vector<std::string>* paths) {
  static const std::set<std::string> kOfPart = {
      "part",       "blade",       "subject",    "scan",        "scans", "registration", "registrations",
      "correction", "corrections", "inspection", "inspections", "study", "studies"};
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    const std::string path = before + field.name();
    if (field.type() == FieldDescriptor::TYPE_STRING && kOfPart.count(field.name()) > 0) paths->push_back(path);
    if (field.type() == FieldDescriptor::TYPE_MESSAGE && depth < 8)
      AddOfPart(*field.message_type(), path + ".", depth + 1, paths);
  }
}

// Of what a method says of parts, so that none can forget to.
std::string PartFaultOf(const MethodDescriptor& method, const Rule& rule) {
  if (rule.no_part() == (rule.filtered() || !rule.of_part().empty()))
    return "of_part, no_part, filtered: want no_part alone, or of_part, filtered or both";
  for (const std::string& path : rule.of_part()) {
    const FieldDescriptor* const field = FieldAt(method.input_type(), path);
    if (field == nullptr || field->type() != FieldDescriptor::TYPE_STRING)
      return "of_part: " + path + ", want a text of " + method.input_type()->name();
  }
  if (method.client_streaming() && !rule.filtered())
    return "of_part: want filtered: what is streamed is its handler's to ask";
  std::vector<std::string> paths;
  AddOfPart(*method.input_type(), "", 0, &paths);
  for (const std::string& path : paths)
    if (!rule.filtered() && !Has(rule.of_part(), path))
      return "of_part: not " + path + ", want what the request can name of a part";
  return "";
}

// What is wrong; empty: nothing.
std::string FaultOf(const MethodDescriptor& method, const Rule& rule) {
  if (rule.anybody()) {
    const bool alone = rule.roles().empty() && rule.own_machine().empty() && !rule.any_machine() &&
                       rule.of_part().empty() && !rule.no_part() && !rule.filtered();
    return alone ? "" : "anybody, want nothing beside it";
  }
  if (rule.roles().empty()) return "no rule, want option (access.v1.rule) with the roles that may call it";
  if (std::count(rule.roles().begin(), rule.roles().end(), sixpoint::access::v1::ROLE_UNSPECIFIED) > 0)
    return "ROLE_UNSPECIFIED, want a role";
  if (const std::string fault = PartFaultOf(method, rule); !fault.empty()) return fault;
  const bool machines = std::count(rule.roles().begin(), rule.roles().end(), sixpoint::access::v1::ROLE_MACHINE) > 0;
  const int said = (rule.own_machine().empty() ? 0 : 1) + (rule.any_machine() ? 1 : 0);
  if (said != (machines ? 1 : 0))
    return "own_machine or any_machine, want one of them where machines may call, else none";
  if (rule.own_machine().empty()) return "";
  const FieldDescriptor* const field = FieldAt(method.input_type(), rule.own_machine());
  if (field == nullptr || field->type() != FieldDescriptor::TYPE_STRING)
    return "own_machine: " + rule.own_machine() + ", want a text of " + method.input_type()->name();
  return "";
}

}  // namespace

int main(int argc, char** argv) {
  google::protobuf::FileDescriptorSet contract;
  std::ifstream in(argc == 2 ? argv[1] : "", std::ios::binary);
  if (!contract.ParseFromIstream(&in) || contract.file().empty()) {
    std::cerr << "usage: sixpoint-check-rules CONTRACT\n";
    return 2;
  }
  google::protobuf::DescriptorPool pool;
  for (const auto& file : contract.file()) pool.BuildFile(file);
  int methods = 0, faults = 0;
  for (const auto& file : contract.file()) {
    if (file.package().rfind("sixpoint.", 0) != 0) continue;
    for (const auto& service : file.service()) {
      for (const auto& method : service.method()) {
        const std::string name = file.package() + "." + service.name() + "." + method.name();
        const std::string fault =
            FaultOf(*pool.FindMethodByName(name), method.options().GetExtension(sixpoint::access::v1::rule));
        if (!fault.empty()) std::cerr << name << ": " << fault << "\n";
        faults += fault.empty() ? 0 : 1;
        ++methods;
      }
    }
  }
  if (methods == 0) std::cerr << "the contract has no method\n";
  return methods > 0 && faults == 0 ? 0 : 1;
}
