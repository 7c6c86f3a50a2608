#include "tests/end_to_end/contract_calls.h"

#include <google/protobuf/descriptor.pb.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>

#include "tests/end_to_end/plant_processes.h"

namespace sixpoint::testing {

using google::protobuf::MethodDescriptor;

ContractMethods::ContractMethods() {
  std::ifstream in(PlantProcesses::Program("../contract.binpb"), std::ios::binary);
  google::protobuf::FileDescriptorSet files;
  EXPECT_TRUE(files.ParseFromIstream(&in));
  for (const auto& file : files.file()) {
    const auto* built = pool_.BuildFile(file);
    if (built == nullptr || file.package().rfind("sixpoint.", 0) != 0) continue;
    for (int s = 0; s < built->service_count(); ++s)
      for (int m = 0; m < built->service(s)->method_count(); ++m) methods_.push_back(built->service(s)->method(m));
  }
}

std::unique_ptr<google::protobuf::Message> ContractMethods::NewRequest(const MethodDescriptor& method) {
  return std::unique_ptr<google::protobuf::Message>(messages_.GetPrototype(method.input_type())->New());
}

std::string AreaOf(const MethodDescriptor& method) {
  const std::string package = method.service()->file()->package();
  const std::size_t begin = package.find('.') + 1;
  return package.substr(begin, package.find('.', begin) - begin);
}

CallAnswer CallMethod(const std::shared_ptr<grpc::Channel>& channel, const MethodDescriptor& method,
                      const std::string& request, const std::string& requested_for) {
  CallAnswer answer;
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(20));
  if (!requested_for.empty()) context.AddMetadata("sixpoint-requested-for", requested_for);
  grpc::CompletionQueue queue;
  const auto next = [&queue] {
    void* tag = nullptr;
    bool done = false;
    return queue.Next(&tag, &done) && done;
  };
  const auto call = stub.PrepareCall(&context, "/" + method.service()->full_name() + "/" + method.name(), &queue);
  call->StartCall(nullptr);
  next();
  grpc::Slice slice(request);
  call->Write(grpc::ByteBuffer(&slice, 1), nullptr);
  next();
  call->WritesDone(nullptr);
  next();
  // A watch never ends by itself: once nothing more comes it is ended here, which is no failure of it.
  const bool is_watch = method.name().rfind("Watch", 0) == 0;
  bool has_ended_it = false;
  const auto next_of = [&] {
    void* tag = nullptr;
    bool done = false;
    const auto soon = std::chrono::system_clock::now() + std::chrono::milliseconds(400);
    if (!is_watch || queue.AsyncNext(&tag, &done, soon) != grpc::CompletionQueue::TIMEOUT)
      return is_watch ? done : next();
    has_ended_it = true;
    context.TryCancel();
    return next();
  };
  for (grpc::ByteBuffer received;; received.Clear()) {
    call->Read(&received, nullptr);
    if (!next_of()) break;
    std::vector<grpc::Slice> slices;
    if (!received.Dump(&slices).ok()) break;
    for (const grpc::Slice& part : slices)
      answer.bytes.append(reinterpret_cast<const char*>(part.begin()), part.size());
  }
  call->Finish(&answer.status, nullptr);
  next();
  if (has_ended_it && answer.status.error_code() == grpc::StatusCode::CANCELLED) answer.status = grpc::Status::OK;
  for (const auto* metadata : {&context.GetServerInitialMetadata(), &context.GetServerTrailingMetadata()})
    for (const auto& [key, value] : *metadata) answer.bytes.append(value.data(), value.size());
  return answer;
}

}  // namespace sixpoint::testing
