#include "idl/trust.hpp"

#include "core/errors.hpp"
#include "idl/dds_log.hpp"

#include <sodium.h>
#include <sys/random.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

namespace consort::wire {
namespace {

constexpr std::size_t kMostRefusals = 200;    // kinds of them that are told apart: a stranger may bring many writers
constexpr std::size_t kMostStrangers = 1000;  // remembered by one gate
constexpr std::size_t kLeastSecret = 16;      // characters

std::string hexadecimal(std::span<const unsigned char> bytes) {
  std::string text(2 * bytes.size() + 1, '\0');
  sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
  text.pop_back();
  return text;
}

void hash(std::span<unsigned char> out, std::string_view text, std::span<const unsigned char> key, std::span<const unsigned char> before) {
  crypto_generichash_state state;
  crypto_generichash_init(&state, key.data(), key.size(), out.size());
  crypto_generichash_update(&state, before.data(), before.size());
  crypto_generichash_update(&state, reinterpret_cast<const unsigned char*>(text.data()), text.size());
  crypto_generichash_final(&state, out.data(), out.size());
}

}  // namespace

RunKey::RunKey() : RunKey(std::string_view{}) {}

RunKey::RunKey(std::string_view secret) {
  if (sodium_init() < 0) throw RunError("libsodium cannot be used on this machine");
  const std::string wire = Build::own().wire;
  hash(bytes_, secret, {}, std::span(reinterpret_cast<const unsigned char*>(wire.data()), wire.size()));
}

RunKey::Badge RunKey::badge(const dds_guid_t& participant, std::string_view topic) const {
  Badge badge;
  hash(badge, topic, bytes_, participant.v);
  return badge;
}

std::string RunKey::random_secret() {
  std::array<unsigned char, 16> bytes;
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw RunError("the kernel gives no random number for the key of the run");
  return hexadecimal(bytes);
}

std::optional<std::string> RunKey::secret_of_environment() {
  const char* secret = std::getenv(kVariable);
  if (secret == nullptr) return std::nullopt;
  if (std::strlen(secret) < kLeastSecret)
    throw ConfigError(std::string(kVariable) + ": found " + std::to_string(std::strlen(secret)) + " characters; allowed: at least " +
                      std::to_string(kLeastSecret));
  return secret;
}

RunKey RunKey::of_environment() {
  if (const auto secret = secret_of_environment()) return RunKey(*secret);
  throw ConfigError(std::string(kVariable) +
                    ": not set; the processes of a run know each other by it, and `consort run --external` prints it or takes it from the "
                    "same variable");
}

// --- refusals ---------------------------------------------------------------------------------------------------------

void Refusals::add(Refusal refusal) {
  const std::lock_guard lock(mutex_);
  auto known = std::find_if(refusals_.begin(), refusals_.end(), [&](const Refusal& each) { return each.same(refusal); });
  if (known == refusals_.end() && refusals_.size() >= kMostRefusals) {
    refusal = {"", refusal.reason, "", "", "others", refusal.samples};  // the count stays right
    known = std::find_if(refusals_.begin(), refusals_.end(), [&](const Refusal& each) { return each.same(refusal); });
  }
  if (known == refusals_.end())
    refusals_.push_back(std::move(refusal));
  else
    known->samples += refusal.samples;
}

std::vector<Refusal> Refusals::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(refusals_, {});
}

std::vector<Refusal> Refusals::seen() const {
  const std::lock_guard lock(mutex_);
  return refusals_;
}

// --- participant ------------------------------------------------------------------------------------------------------

Participant::Participant(const dds::domain::DomainParticipant& entity, const RunKey& key)
    : shared_(std::make_shared<Shared>(entity, key)) {}

Participant::Participant(const dds::domain::Domain& domain, const Card& card, const RunKey& key)
    : Participant(
          dds::domain::DomainParticipant(domain, dds::domain::qos::DomainParticipantQos() << dds::core::policy::UserData(card.bytes())),
          key) {}

std::string Participant::guid() const { return hexadecimal(shared_->guid.v); }

dds::core::policy::UserData Participant::badge(std::string_view topic) const {
  return dds::core::policy::UserData(shared_->key.badge(shared_->guid, topic));
}

bool Participant::trusts(Kind kind, dds::core::InstanceHandle endpoint) const {
  // Where an endpoint of ours and one elsewhere come up at the same time, their match may be told a moment before the built-in topic
  // knows the other one. Who is never found is gone again: nobody can vouch for it.
  constexpr std::chrono::seconds kPatience{1};
  const auto& endpoints = kind == Kind::writers ? shared_->writers : shared_->readers;
  const auto until = std::chrono::steady_clock::now() + kPatience;
  auto found = endpoints.find(endpoint);
  while (!found && std::chrono::steady_clock::now() < until) {
    std::this_thread::yield();
    found = endpoints.find(endpoint);
  }
  if (!found) return false;
  const RunKey::Badge expected = shared_->key.badge(found->participant_key, found->topic_name);
  return found->user_data.size() == expected.size() && sodium_memcmp(found->user_data.data(), expected.data(), expected.size()) == 0;
}

std::vector<Refusal> Participant::take_refusals() const {
  std::vector<Refusal> all = shared_->refusals.take();
  if (const std::uint64_t malformed = DdsLog::of_this_process().take_malformed(); malformed > 0)
    all.push_back({"", Refusal::Reason::malformed, "", "", "", malformed});
  return all;
}

Sender Participant::sender(dds::core::InstanceHandle writer) const {
  Sender sender;
  const auto found = shared_->writers.find(writer);
  if (!found) return sender;
  sender.guid = hexadecimal(found->participant_key.v);
  const dds::domain::ParticipantBuiltinTopicData process = shared_->participants.find(found->participant_key);
  sender.card = Card::of(process.user_data);
  if (process.pid.empty()) return sender;
  const std::string ids = sender.card ? sender.card->ids : std::string();
  const std::string agents = ids.empty() ? "" : (ids.find_first_of("-,") == std::string::npos ? " of agent " : " of agents ") + ids;
  sender.who = process.process + agents + " (pid " + process.pid + " on " + process.host + ")";
  return sender;
}

void Participant::name(Refusal& refusal, dds::core::InstanceHandle writer) const {
  const Sender sender = this->sender(writer);
  refusal.writer = sender.guid;
  refusal.who = sender.who;
  if (refusal.reason != Refusal::Reason::stranger || !sender.card) return;
  const bool same_wire = sender.card->build.wire == Build::own().wire;
  refusal.reason = same_wire ? Refusal::Reason::key : Refusal::Reason::build;
  if (!same_wire) refusal.who += ", which is " + sender.card->build.text();
}

// --- gate -------------------------------------------------------------------------------------------------------------

bool Gate::judge(Handle endpoint) {
  {
    const std::lock_guard lock(mutex_);
    if (trusted_.contains(endpoint)) return true;
    if (strangers_.contains(endpoint)) return false;
  }
  if (participant_.trusts(judges_, endpoint)) {
    const std::lock_guard lock(mutex_);
    trusted_.insert(endpoint);
    return true;
  }
  Refusal stranger{topic_, Refusal::Reason::stranger, "", "", "", 0};
  if (judges_ == Kind::writers) {
    participant_.name(stranger, endpoint);
    participant_.refuse(stranger);  // named even if its samples are such that DDS itself drops them
  }
  const std::lock_guard lock(mutex_);
  if (strangers_.size() >= kMostStrangers) strangers_.clear();
  strangers_.emplace(endpoint, std::move(stranger));
  return false;
}

bool Gate::judge_sample(Handle writer) {
  if (judge(writer)) {
    last_ = writer;
    return true;
  }
  Refusal refusal{topic_, Refusal::Reason::stranger, "", "", "", 0};
  {
    const std::lock_guard lock(mutex_);
    const auto known = strangers_.find(writer);
    if (known != strangers_.end()) refusal = known->second;
  }
  refusal.samples = 1;
  participant_.refuse(std::move(refusal));
  return false;
}

void Gate::refuse(Handle writer, const char* field) const {
  Refusal refusal{topic_, Refusal::Reason::bound, field, "", "", 1};
  participant_.name(refusal, writer);
  participant_.refuse(std::move(refusal));
}

Gate::Matches Gate::matched(Handle endpoint, std::int32_t change) {
  const bool trusted = change > 0 && judge(endpoint);
  const std::lock_guard lock(mutex_);
  if (change < 0)
    present_.erase(endpoint);
  else if (trusted)
    present_.insert(endpoint);
  return {present_.size(), trusted_.size()};
}

}  // namespace consort::wire
