// Every bound that the contract gives a field of a request is kept, in every request, wherever the field stands in it.
#include "services/runtime/request_checks.h"

#include <gmock/gmock.h>
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/runtime/errors.h"
#include "sixpoint/bounds/v1/bounds.pb.h"
#include "sixpoint/calibration/v1/calibration.pb.h"
#include "sixpoint/calibration/v1/study.pb.h"
#include "sixpoint/correction/v1/correction.pb.h"
#include "sixpoint/ingest/v1/ingest.pb.h"
#include "sixpoint/ingest/v1/store.pb.h"
#include "sixpoint/inspection/v1/inspection.pb.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/plant/v1/record.pb.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::runtime {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;
using google::protobuf::ServiceDescriptor;
using ::testing::ElementsAre;

std::vector<const MethodDescriptor*> Methods() {
  std::vector<const MethodDescriptor*> methods;
  for (const google::protobuf::Descriptor* one :
       {plant::v1::CreatePartRequest::descriptor(), plant::v1::RecallRequest::descriptor(),
        ingest::v1::UploadScanRequest::descriptor(), ingest::v1::ApplyRetentionRequest::descriptor(),
        calibration::v1::GetCalibrationRequest::descriptor(), calibration::v1::GetStudyRequest::descriptor(),
        registration::v1::RegisterRequest::descriptor(), correction::v1::CorrectRequest::descriptor(),
        inspection::v1::InspectRequest::descriptor()})
    for (int s = 0; s < one->file()->service_count(); ++s)
      for (int m = 0; m < one->file()->service(s)->method_count(); ++m)
        methods.push_back(one->file()->service(s)->method(m));
  return methods;
}

std::unique_ptr<Message> NewRequest(const google::protobuf::Descriptor* type) {
  return std::unique_ptr<Message>(google::protobuf::MessageFactory::generated_factory()->GetPrototype(type)->New());
}

// A field somewhere in a request: the way to it, and how it is called.
struct Place {
  std::vector<const FieldDescriptor*> way;
  std::string text;
};

void AddPlaces(const google::protobuf::Descriptor* type, const Place& at, std::vector<Place>* places) {
  for (int i = 0; i < type->field_count(); ++i) {
    const FieldDescriptor* field = type->field(i);
    Place place = at;
    place.way.push_back(field);
    place.text += (at.text.empty() ? "" : ".") + field->name();
    if (field->options().HasExtension(bounds::v1::most_items) || field->options().HasExtension(bounds::v1::most_bytes))
      places->push_back(place);
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE || place.way.size() > 6) continue;
    if (field->is_repeated()) place.text += "[0]";
    AddPlaces(field->message_type(), place, places);
  }
}

// The message that holds the place's field, made on the way.
Message* HolderOf(const Place& place, Message* request) {
  for (std::size_t i = 0; i + 1 < place.way.size(); ++i) {
    const auto* reflection = request->GetReflection();
    request = place.way[i]->is_repeated() ? reflection->AddMessage(request, place.way[i])
                                          : reflection->MutableMessage(request, place.way[i]);
  }
  return request;
}

void AddItem(const FieldDescriptor* field, const std::string& text, Message* holder) {
  const auto* reflection = holder->GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection->AddString(holder, field, text);
    case FieldDescriptor::CPPTYPE_MESSAGE:
      reflection->AddMessage(holder, field);
      return;
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection->AddDouble(holder, field, 0);
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection->AddEnumValue(holder, field, 0);
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection->AddInt32(holder, field, 0);
    default:
      FAIL() << field->full_name() << ": a kind of list that this test cannot fill";
  }
}

std::vector<std::string> FieldsOf(const absl::Status& status) {
  std::vector<std::string> fields;
  for (const Violation& violation : ViolationsOf(status)) fields.push_back(violation.field);
  return fields;
}

TEST(CheckBounds, KeepsEveryBoundOfTheContract) {
  int bound_count = 0;
  for (const MethodDescriptor* method : Methods()) {
    std::vector<Place> places;
    AddPlaces(method->input_type(), {}, &places);
    for (const Place& place : places) {
      SCOPED_TRACE(method->full_name() + " " + place.text);
      const FieldDescriptor* field = place.way.back();
      const auto most_items = field->options().GetExtension(bounds::v1::most_items);
      const auto most_bytes = field->options().GetExtension(bounds::v1::most_bytes);
      if (most_items > 0) {
        ++bound_count;
        const auto request = NewRequest(method->input_type());
        Message* holder = HolderOf(place, request.get());
        for (std::uint32_t i = 0; i < most_items; ++i) AddItem(field, "", holder);
        EXPECT_TRUE(CheckBounds(*request).ok()) << CheckBounds(*request);
        AddItem(field, "", holder);
        EXPECT_THAT(FieldsOf(CheckBounds(*request)), ElementsAre(place.text));
      }
      if (most_bytes > 0) {
        ++bound_count;
        for (const std::uint32_t size : {most_bytes, most_bytes + 1}) {
          const auto request = NewRequest(method->input_type());
          Message* holder = HolderOf(place, request.get());
          if (field->is_repeated())
            AddItem(field, std::string(size, 'x'), holder);
          else
            holder->GetReflection()->SetString(holder, field, std::string(size, 'x'));
          const absl::Status status = CheckBounds(*request);
          if (size == most_bytes)
            EXPECT_TRUE(status.ok()) << status;
          else
            EXPECT_THAT(FieldsOf(status), ElementsAre(place.text + (field->is_repeated() ? "[0]" : "")));
        }
      }
    }
  }
  EXPECT_GT(bound_count, 200);
}

TEST(CheckBounds, NamesAllThatIsTooMuchAndNeverShowsIt) {
  plant::v1::CreatePartRequest request;
  request.set_part_id(std::string(65, 'x'));
  auto* group = request.mutable_part()->add_hole_groups();
  group->add_holes();
  group->add_holes()->set_hole(std::string("H\0", 2));
  request.set_cad(std::string("\0\0", 2));  // bytes may be any
  const absl::Status status = CheckBounds(request);
  EXPECT_EQ(ViolationsOf(status),
            (std::vector<Violation>{{"part_id", "65 bytes", "at most 64 bytes"},
                                    {"part.hole_groups[0].holes[1].hole", "a NUL byte", "text"}}));
}

TEST(CheckRequestId, IsDemandedOfEveryCallThatChangesSomething) {
  int demanding = 0;
  for (const MethodDescriptor* method : Methods()) {
    SCOPED_TRACE(method->full_name());
    const auto request = NewRequest(method->input_type());
    const FieldDescriptor* field = method->input_type()->FindFieldByName("request_id");
    if (field == nullptr) {
      EXPECT_TRUE(CheckRequestId(*method, *request).ok());
      continue;
    }
    ++demanding;
    EXPECT_THAT(FieldsOf(CheckRequestId(*method, *request)), ElementsAre("request_id"));
    request->GetReflection()->SetString(request.get(), field, "no uuid");
    EXPECT_THAT(FieldsOf(CheckRequestId(*method, *request)), ElementsAre("request_id"));
    request->GetReflection()->SetString(request.get(), field, "018f6f3e-7c1a-7e5b-9d5a-2f1c3b4a5d6e");
    EXPECT_TRUE(CheckRequestId(*method, *request).ok());
  }
  EXPECT_GE(demanding, 19);
}

}  // namespace
}  // namespace sixpoint::runtime
