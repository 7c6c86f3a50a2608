// Every method of the contract as it was built, and a call of any of them, by bytes.
#pragma once

#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>
#include <vector>

namespace sixpoint::testing {

class ContractMethods {
 public:
  ContractMethods();
  const std::vector<const google::protobuf::MethodDescriptor*>& methods() const { return methods_; }
  std::unique_ptr<google::protobuf::Message> NewRequest(const google::protobuf::MethodDescriptor& method);

 private:
  google::protobuf::DescriptorPool pool_;
  google::protobuf::DynamicMessageFactory messages_{&pool_};
  std::vector<const google::protobuf::MethodDescriptor*> methods_;
};

// "sixpoint.plant.v1.PlantService" is the plant's.
std::string AreaOf(const google::protobuf::MethodDescriptor& method);

struct CallAnswer {
  grpc::Status status;
  std::string bytes;  // of all messages that came, one after the other, with the metadata that came with them
};
// One request, as bytes. requested_for: whom a service calls for; empty: nobody.
CallAnswer CallMethod(const std::shared_ptr<grpc::Channel>& channel, const google::protobuf::MethodDescriptor& method,
                      const std::string& request, const std::string& requested_for = "");

}  // namespace sixpoint::testing
