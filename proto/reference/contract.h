// The contract as it is read to tell about it: build/PRESET/contract.binpb, comments included.
#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

namespace sixpoint::reference {

// All of our files, in the order in which they import each other. Ends the program, saying why, where the file cannot be read.
std::vector<const google::protobuf::FileDescriptor*> ReadContract(const std::string& file,
                                                                  google::protobuf::DescriptorPool* pool);

// The element's own comment, before it or behind it, in one line.
std::string CommentOf(const google::protobuf::SourceLocation& at);
template <typename Element>
std::string CommentOf(const Element& element) {
  google::protobuf::SourceLocation at;
  return element.GetSourceLocation(&at) ? CommentOf(at) : "";
}

// "ENGINEER, QUALITY", or "anybody".
std::string WhoMayCall(const google::protobuf::MethodDescriptor& method);
bool IsWithoutSideEffects(const google::protobuf::MethodDescriptor& method);

std::string OpenApi(const std::vector<const google::protobuf::FileDescriptor*>& files, const std::string& doors_json);
// One area: "plant" of sixpoint.plant.v1; with services of its own or only messages.
std::string Markdown(const std::vector<const google::protobuf::FileDescriptor*>& files, const std::string& package);

}  // namespace sixpoint::reference
