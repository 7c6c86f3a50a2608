// The handlers of persons on a fake store: no PostgreSQL.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "services/plant/person_service.h"
#include "tests/support/becomes.h"
#include "tests/support/call.h"
#include "tests/support/fake_persons.h"
#include "tests/support/in_process_server.h"

namespace sixpoint::plant {
namespace {

using testing::Call;
using ::testing::ElementsAre;
using ::testing::UnorderedElementsAre;
using PersonStub = v1::PersonService::Stub;

class PersonHandlersTest : public ::testing::Test {
 protected:
  absl::StatusOr<v1::ListPersonsResponse> List(const v1::ListPersonsRequest& request = {}) {
    return Call(*stub_, &PersonStub::ListPersons, request);
  }
  absl::StatusOr<v1::ListPersonsResponse> ListOf(const std::string& person) {
    v1::ListPersonsRequest request;
    request.set_person(person);
    return List(request);
  }
  absl::StatusOr<v1::Person> Forget(const std::string& name) {
    v1::ForgetPersonRequest request;
    request.set_name(name);
    return Call(*stub_, &PersonStub::ForgetPerson, request);
  }

  std::shared_ptr<testing::FakePersons> persons_ = std::make_shared<testing::FakePersons>();
  PersonService service_{persons_};
  testing::InProcessServer server_{{&service_}};
  std::unique_ptr<PersonStub> stub_ = v1::PersonService::NewStub(server_.Connect());
};

TEST_F(PersonHandlersTest, PersonsAreListedByPages) {
  std::vector<std::string> names;
  for (const char* user : {"jane", "jim", "joe"}) names.push_back("persons/" + persons_->See(user));
  std::sort(names.begin(), names.end());
  v1::ListPersonsRequest request;
  request.set_page_size(2);
  const auto first = List(request);
  ASSERT_TRUE(first.ok()) << first.status();
  ASSERT_EQ(first->persons_size(), 2);
  EXPECT_EQ(first->persons(0).name(), names[0]);
  EXPECT_EQ(first->persons(1).name(), names[1]);
  EXPECT_TRUE(first->persons(0).has_first_seen_at());
  EXPECT_FALSE(first->persons(0).has_forgotten_at());
  request.set_page_token(first->next_page_token());
  const auto second = List(request);
  ASSERT_TRUE(second.ok()) << second.status();
  ASSERT_EQ(second->persons_size(), 1);
  EXPECT_EQ(second->persons(0).name(), names[2]);
  EXPECT_EQ(second->next_page_token(), "");
  EXPECT_THAT((std::vector<std::string>{first->persons(0).user(), first->persons(1).user(), second->persons(0).user()}),
              UnorderedElementsAre("users/jane", "users/jim", "users/joe"));
  // A token is of its own list.
  request.set_person("users/jane");
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument);
}

TEST_F(PersonHandlersTest, OneIsListedByNameOrPseudonym) {
  const std::string pseudonym = "persons/" + persons_->See("jane");
  persons_->See("joe");
  for (const std::string& person : {std::string("users/jane"), pseudonym}) {
    const auto listed = ListOf(person);
    ASSERT_TRUE(listed.ok()) << listed.status();
    ASSERT_EQ(listed->persons_size(), 1) << person;
    EXPECT_EQ(listed->persons(0).name(), pseudonym);
    EXPECT_EQ(listed->persons(0).user(), "users/jane");
  }
  EXPECT_EQ(ListOf("users/nobody")->persons_size(), 0);
}

TEST_F(PersonHandlersTest, WhoIsForgottenIsAnsweredUnderThePseudonymAndAgainTheSame) {
  const std::string pseudonym = "persons/" + persons_->See("jane");
  const auto forgotten = Forget("users/jane");
  ASSERT_TRUE(forgotten.ok()) << forgotten.status();
  EXPECT_EQ(forgotten->name(), pseudonym);
  EXPECT_EQ(forgotten->user(), "");
  EXPECT_TRUE(forgotten->has_forgotten_at());
  EXPECT_EQ(Forget(pseudonym)->SerializeAsString(), forgotten->SerializeAsString());
  EXPECT_EQ(ListOf(pseudonym)->persons(0).SerializeAsString(), forgotten->SerializeAsString());
  const absl::Status unknown = Forget("users/jane").status();
  EXPECT_EQ(runtime::ReasonOf(unknown), "PERSON_NOT_FOUND");
  EXPECT_EQ(runtime::MetadataOf(unknown)["resource"], "users/jane");
}

TEST_F(PersonHandlersTest, WhatIsNoNameOfAPersonIsRefused) {
  persons_->See("jane");
  constexpr char kWanted[] = "users/{user} or persons/{pseudonym}";
  for (const char* name : {"jane", "machines/m1", "users/", "persons/"}) {
    EXPECT_THAT(ViolationsOf(Forget(name).status()), ElementsAre(Violation{"name", name, kWanted})) << name;
    EXPECT_THAT(ViolationsOf(ListOf(name).status()), ElementsAre(Violation{"person", name, kWanted})) << name;
  }
  EXPECT_THAT(ViolationsOf(Forget("").status()), ElementsAre(Violation{"name", "empty", kWanted}));
  v1::ListPersonsRequest request;
  request.set_page_size(-1);
  EXPECT_EQ(List(request).status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(ListOf("users/jane")->persons_size(), 1);
}

TEST_F(PersonHandlersTest, WhatTheStoreRefusesComesToTheClient) {
  persons_->See("jane");
  persons_->SetAccount("jane", true);
  EXPECT_EQ(Forget("users/jane").status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ListOf("users/jane")->persons_size(), 1);
  persons_->commits.Fail(absl::UnavailableError("the database is away"));
  EXPECT_EQ(List().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(Forget("users/jane").status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(PersonHandlersTest, NobodyIsForgottenForAClientThatIsGone) {
  persons_->See("jane");
  const std::unique_ptr<grpc::ClientContext> context = runtime::ContextFor(60);
  persons_->commits.BeforeCommit([&](const storage::StillWanted& still_wanted) {
    context->TryCancel();
    EXPECT_TRUE(testing::Becomes(std::chrono::seconds(30), [&] { return !still_wanted(); }));
  });
  v1::ForgetPersonRequest request;
  request.set_name("users/jane");
  v1::Person response;
  EXPECT_EQ(stub_->ForgetPerson(context.get(), request, &response).error_code(), grpc::StatusCode::CANCELLED);
  EXPECT_EQ(persons_->List({"jane", ""}, "", 1, {})->size(), 1u);
}

}  // namespace
}  // namespace sixpoint::plant
