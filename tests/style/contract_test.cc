// What the contract promises to those who write clients: every element says what it is, every field that a client may set
// says whether it must and how much it may hold, and every method says whether it may be repeated.
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "sixpoint/access/v1/access.pb.h"
#include "sixpoint/bounds/v1/bounds.pb.h"

namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::MethodDescriptor;
using google::protobuf::MethodOptions;
using google::protobuf::ServiceDescriptor;

// Values that are given whole or not at all.
constexpr char kValues[] = "sixpoint.geometry.v1";

// The element's own comment, before it or behind it.
template <typename Element>
std::string CommentOf(const Element& element) {
  google::protobuf::SourceLocation at;
  if (!element.GetSourceLocation(&at)) return "";
  const std::string text = at.leading_comments + at.trailing_comments;
  const auto first = text.find_first_not_of(" \n");
  return first == std::string::npos ? "" : text.substr(first);
}

bool StartsWith(const std::string& text, const std::string& prefix) { return text.rfind(prefix, 0) == 0; }

bool IsOurs(const FileDescriptor* file) { return StartsWith(file->package(), "sixpoint."); }

class Contract : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string path = std::getenv("SIXPOINT_BIN_DIR") + std::string("/../contract.binpb");
    std::ifstream in(path, std::ios::binary);
    google::protobuf::FileDescriptorSet contract;
    ASSERT_TRUE(contract.ParseFromIstream(&in)) << path;
    for (const google::protobuf::FileDescriptorProto& proto : contract.file()) {
      const FileDescriptor* file = pool_.BuildFile(proto);
      ASSERT_NE(file, nullptr) << proto.name();
      if (!IsOurs(file)) continue;
      for (int i = 0; i < file->message_type_count(); ++i) AddMessage(file->message_type(i));
      for (int i = 0; i < file->enum_type_count(); ++i) enums_.push_back(file->enum_type(i));
      for (int i = 0; i < file->service_count(); ++i) services_.push_back(file->service(i));
    }
    for (const ServiceDescriptor* service : services_)
      for (int i = 0; i < service->method_count(); ++i) methods_.push_back(service->method(i));
    ASSERT_GT(methods_.size(), 40u);
  }

  void AddMessage(const Descriptor* message) {
    messages_.push_back(message);
    for (int i = 0; i < message->nested_type_count(); ++i) AddMessage(message->nested_type(i));
    for (int i = 0; i < message->enum_type_count(); ++i) enums_.push_back(message->enum_type(i));
  }

  // Every message that some request holds.
  std::set<const Descriptor*> Sent() const {
    std::set<const Descriptor*> sent;
    const std::function<void(const Descriptor*)> add = [&](const Descriptor* message) {
      if (!IsOurs(message->file()) || !sent.insert(message).second) return;
      for (int i = 0; i < message->field_count(); ++i) {
        const FieldDescriptor* field = message->field(i);
        if (field->message_type() != nullptr && !StartsWith(CommentOf(*field), "Output only."))
          add(field->message_type());
      }
    };
    for (const MethodDescriptor* method : methods_) add(method->input_type());
    return sent;
  }

  google::protobuf::DescriptorPool pool_;
  std::vector<const Descriptor*> messages_;
  std::vector<const EnumDescriptor*> enums_;
  std::vector<const ServiceDescriptor*> services_;
  std::vector<const MethodDescriptor*> methods_;
};

TEST_F(Contract, EveryElementHasACommentOfItsOwn) {
  const auto check = [](const auto& element) { EXPECT_NE(CommentOf(element), "") << element.full_name(); };
  for (const Descriptor* message : messages_) {
    check(*message);
    for (int i = 0; i < message->field_count(); ++i) check(*message->field(i));
  }
  for (const EnumDescriptor* type : enums_) {
    check(*type);
    for (int i = 0; i < type->value_count(); ++i) check(*type->value(i));
  }
  for (const ServiceDescriptor* service : services_) check(*service);
  for (const MethodDescriptor* method : methods_) check(*method);
}

TEST_F(Contract, AFieldThatAClientMaySetSaysWhetherItMust) {
  for (const Descriptor* message : Sent()) {
    if (message->file()->package() == kValues) continue;
    for (int i = 0; i < message->field_count(); ++i) {
      const std::string comment = CommentOf(*message->field(i));
      EXPECT_TRUE(StartsWith(comment, "Required") || StartsWith(comment, "Optional.") ||
                  StartsWith(comment, "Output only."))
          << message->field(i)->full_name() << ": " << comment;
    }
  }
}

TEST_F(Contract, WhatAClientMaySendIsBounded) {
  for (const Descriptor* message : Sent()) {
    for (int i = 0; i < message->field_count(); ++i) {
      const FieldDescriptor* field = message->field(i);
      if (StartsWith(CommentOf(*field), "Output only.")) continue;
      const auto& options = field->options();
      const bool is_text = field->cpp_type() == FieldDescriptor::CPPTYPE_STRING;
      EXPECT_EQ(options.GetExtension(sixpoint::bounds::v1::most_items) > 0, field->is_repeated()) << field->full_name();
      EXPECT_EQ(options.GetExtension(sixpoint::bounds::v1::most_bytes) > 0, is_text) << field->full_name();
    }
  }
}

TEST_F(Contract, WhatTheServerAloneWritesIsNotMarkedForClients) {
  const std::set<const Descriptor*> sent = Sent();
  for (const Descriptor* message : messages_) {
    if (sent.count(message) > 0) continue;
    for (int i = 0; i < message->field_count(); ++i) {
      const std::string comment = CommentOf(*message->field(i));
      EXPECT_FALSE(StartsWith(comment, "Required") || StartsWith(comment, "Optional."))
          << message->field(i)->full_name() << " is in no request";
    }
  }
}

TEST_F(Contract, AMethodThatOnlyReadsSaysSo) {
  const std::vector<std::string> reading = {
      "Get",   "List",   "Download",        "Preview",        "Recall", "Trace", "Replay", "Compute",
      "Watch", "Verify", "PlanMeasurement", "PlanAssessment", "Export", "Write", "Compare"};
  for (const MethodDescriptor* method : methods_) {
    const bool reads = std::any_of(reading.begin(), reading.end(),
                                   [&](const std::string& verb) { return StartsWith(method->name(), verb); });
    EXPECT_EQ(method->options().idempotency_level() == MethodOptions::NO_SIDE_EFFECTS, reads) << method->full_name();
  }
}

// A call that changes something is known again by its request_id, or by what it names.
TEST_F(Contract, AMethodThatChangesSomethingHasARequestId) {
  const std::set<std::string> named_by_what_they_change = {
      "UploadScan",        // a scan_id of the client's
      "DeleteScanPoints",  // a scan's points, once
      "OfferCredentials",  // a pickup_id
      "TakeCredentials",   // the same, once
      "OfferRenewal",      // a certificate
      "ForgetPerson",      // a person, once
      // an account, and what it is to be
      "CreateAccount", "SetAccountRoles", "SetPassword", "ChangeOwnPassword", "DisableAccount", "EnableAccount",
      // an account or a session; another one is as good
      "SignIn", "SignInWithIdToken", "RenewSession", "SignOut",
      "CheckStore",                                                      // reads, and notes what is damaged
      "CollectGarbage", "ApplyRetention", "AdoptBucket", "MakeMonths"};  // again: what is left to do
  for (const MethodDescriptor* method : methods_) {
    if (method->options().idempotency_level() == MethodOptions::NO_SIDE_EFFECTS) continue;
    EXPECT_EQ(method->input_type()->FindFieldByName("request_id") == nullptr,
              named_by_what_they_change.count(method->name()) > 0)
        << method->full_name();
  }
}

// Who may call what, as people have looked at it: a rule that changes changes this page too.
TEST_F(Contract, TheRulesAreThoseOfThePage) {
  std::string page;
  for (const MethodDescriptor* method : methods_) {
    const auto& rule = method->options().GetExtension(sixpoint::access::v1::rule);
    std::string line = method->service()->name() + "." + method->name() + ":";
    for (const int role : rule.roles()) line += " " + sixpoint::access::v1::Role_Name(role).substr(5);
    if (rule.anybody()) line += " anybody";
    if (!rule.own_machine().empty()) line += "; own machine by " + rule.own_machine();
    if (rule.any_machine()) line += "; any machine";
    for (const std::string& path : rule.of_part()) line += (&path == &rule.of_part(0) ? "; of part by " : ", ") + path;
    if (rule.filtered()) line += "; filtered";
    if (rule.no_part()) line += "; no part";
    page += line + "\n";
  }
  std::ifstream in(std::string(std::getenv("SIXPOINT_SOURCE_DIR")) + "/docs/access_rules.txt");
  std::stringstream kept;
  kept << in.rdbuf();
  EXPECT_EQ(kept.str(), page);
}

// What a client that was built of a contract before relies on.
std::string ShapeOf(const FieldDescriptor& field) {
  std::string shape = field.full_name() + " = " + std::to_string(field.number()) + ", " + field.type_name() + ", ";
  shape += field.is_map() ? "map" : field.is_repeated() ? "repeated" : field.has_presence() ? "one or none" : "one";
  if (field.message_type() != nullptr) shape += ", " + field.message_type()->full_name();
  if (field.enum_type() != nullptr) shape += ", " + field.enum_type()->full_name();
  if (field.real_containing_oneof() != nullptr) shape += ", of " + field.real_containing_oneof()->full_name();
  return shape;
}
std::string ShapeOf(const MethodDescriptor& method) {
  return method.full_name() + "(" + (method.client_streaming() ? "stream " : "") + method.input_type()->full_name() +
         ") " + (method.server_streaming() ? "stream " : "") + method.output_type()->full_name();
}
void AddShapes(const Descriptor& message, std::set<std::string>* shapes) {
  shapes->insert(message.full_name());
  for (int i = 0; i < message.field_count(); ++i) shapes->insert(ShapeOf(*message.field(i)));
  for (int i = 0; i < message.nested_type_count(); ++i) AddShapes(*message.nested_type(i), shapes);
  for (int i = 0; i < message.enum_type_count(); ++i)
    for (int k = 0; k < message.enum_type(i)->value_count(); ++k)
      shapes->insert(message.enum_type(i)->value(k)->full_name() + " = " +
                     std::to_string(message.enum_type(i)->value(k)->number()));
}
std::set<std::string> ShapesOf(const FileDescriptor& file) {
  std::set<std::string> shapes;
  for (int i = 0; i < file.message_type_count(); ++i) AddShapes(*file.message_type(i), &shapes);
  for (int i = 0; i < file.enum_type_count(); ++i)
    for (int k = 0; k < file.enum_type(i)->value_count(); ++k)
      shapes.insert(file.enum_type(i)->value(k)->full_name() + " = " +
                    std::to_string(file.enum_type(i)->value(k)->number()));
  for (int i = 0; i < file.service_count(); ++i)
    for (int k = 0; k < file.service(i)->method_count(); ++k) shapes.insert(ShapeOf(*file.service(i)->method(k)));
  return shapes;
}

// `buf breaking` (check_protos) knows more of it; this one is asked on every computer.
TEST_F(Contract, WhatWasPromisedStays) {
  std::ifstream in(std::string(std::getenv("SIXPOINT_SOURCE_DIR")) + "/proto/frozen.binpb", std::ios::binary);
  google::protobuf::FileDescriptorSet frozen;
  ASSERT_TRUE(frozen.ParseFromIstream(&in));
  google::protobuf::DescriptorPool pool;
  std::size_t promised_count = 0;
  for (const google::protobuf::FileDescriptorProto& proto : frozen.file()) {
    const FileDescriptor* const before = pool.BuildFile(proto);
    ASSERT_NE(before, nullptr) << proto.name();
    if (!IsOurs(before)) continue;
    const FileDescriptor* const now = pool_.FindFileByName(proto.name());
    ASSERT_NE(now, nullptr) << proto.name() << " is gone";
    const std::set<std::string> shapes = ShapesOf(*now);
    for (const std::string& promised : ShapesOf(*before)) {
      EXPECT_EQ(shapes.count(promised), 1u) << promised << ": gone, or another; a contract only grows";
      ++promised_count;
    }
  }
  EXPECT_GT(promised_count, 1000u);
}

TEST_F(Contract, AMethodWithARequestIdMayBeRepeated) {
  for (const MethodDescriptor* method : methods_) {
    if (method->input_type()->FindFieldByName("request_id") == nullptr) continue;
    EXPECT_EQ(method->options().idempotency_level(), MethodOptions::IDEMPOTENT) << method->full_name();
  }
}

}  // namespace
