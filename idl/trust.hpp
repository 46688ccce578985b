#pragma once
/// Who belongs to a run. Its processes know a key, which never goes on the wire; every writer and reader of a run shows a badge, made of
/// the key, its participant's name on the network and its topic, in its announcement (USER_DATA). A badge that somebody copies is worth
/// nothing, since his participant has another name. Samples of writers without a badge are left out, counted and named; readers without
/// one are not counted among those a run waits for.
///
/// This keeps out whoever takes part through DDS. It does not encrypt, and whoever forges network packets needs DDS Security against him.

#include "idl/card.hpp"
#include "idl/refusal.hpp"

#include <dds/dds.hpp>

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace consort::wire {

/// What the processes of one run know. The default is a key everybody knows.
class RunKey {
 public:
  using Badge = std::array<unsigned char, 16>;

  RunKey();
  /// Of any text. Processes whose wires differ have different keys whatever the secret: neither takes a sample of the other.
  explicit RunKey(std::string_view secret);
  /// Keyed hash (BLAKE2b) of the participant's GUID and the topic's name.
  [[nodiscard]] Badge badge(const dds_guid_t& participant, std::string_view topic) const;

  static constexpr const char* kVariable = "CONSORT_KEY";  ///< environment variable that holds the secret
  /// 32 hexadecimal digits from the kernel's random numbers.
  static std::string random_secret();
  /// What $CONSORT_KEY holds, if it is set. Throws ConfigError if that is too short to be a secret.
  static std::optional<std::string> secret_of_environment();
  /// The key of $CONSORT_KEY. Throws ConfigError saying where it is to be had if there is none.
  static RunKey of_environment();

 private:
  std::array<unsigned char, 32> bytes_;
};

/// What was refused since it was last taken. Any thread.
class Refusals {
 public:
  void add(Refusal refusal);
  std::vector<Refusal> take();
  [[nodiscard]] std::vector<Refusal> seen() const;

 private:
  mutable std::mutex mutex_;
  std::vector<Refusal> refusals_;  // few: at most kMost
};

/// A participant of a run: what its readers and writers need to know of whom they may listen to.
class Participant {
 public:
  /// Implicit: a participant without a key trusts those without one.
  Participant(const dds::domain::DomainParticipant& entity, const RunKey& key = {});
  /// One that says what it is.
  Participant(const dds::domain::Domain& domain, const Card& card, const RunKey& key);

  operator const dds::domain::DomainParticipant&() const { return shared_->entity; }
  /// What an endpoint of this participant shows.
  [[nodiscard]] dds::core::policy::UserData badge(std::string_view topic) const;
  using Kind = dds::domain::DiscoveredEndpoints::Kind;
  /// Does that endpoint belong to the run?
  [[nodiscard]] bool trusts(Kind kind, dds::core::InstanceHandle endpoint) const;
  /// Its name on the network, as Sender has those of others.
  [[nodiscard]] std::string guid() const;
  /// Who is behind a writer.
  [[nodiscard]] Sender sender(dds::core::InstanceHandle writer) const;
  /// Writes the participant and the process behind a writer into the refusal, as far as they are known. Of a stranger that is a process of
  /// Consort it says what is wrong with it.
  void name(Refusal& refusal, dds::core::InstanceHandle writer) const;

  void refuse(Refusal refusal) const { shared_->refusals.add(std::move(refusal)); }
  /// Also what DDS could not read, whosever it is.
  std::vector<Refusal> take_refusals() const;
  /// The same without what DDS could not read, and leaving them where they are.
  [[nodiscard]] std::vector<Refusal> refusals() const { return shared_->refusals.seen(); }

 private:
  struct Shared {
    Shared(const dds::domain::DomainParticipant& participant, const RunKey& run) : entity(participant), key(run) {}
    dds::domain::DomainParticipant entity;
    RunKey key;
    dds::domain::DiscoveredParticipants participants{entity};
    dds::domain::DiscoveredEndpoints writers{entity, Kind::writers}, readers{entity, Kind::readers};
    dds_guid_t guid = entity.guid();
    Refusals refusals;
  };
  std::shared_ptr<Shared> shared_;
};

/// The doorkeeper of one reader (judges writers) or of one writer (judges readers): looks at each endpoint it is matched with once.
class Gate {
 public:
  using Handle = dds::core::InstanceHandle;
  using Kind = Participant::Kind;

  /// `judges`: the other side's kind.
  Gate(Participant participant, std::string topic, Kind judges)
      : participant_(std::move(participant)), topic_(std::move(topic)), judges_(judges) {}

  struct Matches {
    std::size_t now = 0, ever = 0;  ///< endpoints of the run
  };
  /// Takes note of a match (`change` > 0) or of its end.
  Matches matched(Handle endpoint, std::int32_t change);
  /// May this writer's sample be taken? Counts it if not. That the writer is the one of the sample before costs a comparison to find.
  bool admits(Handle writer) { return writer == last_ || judge_sample(writer); }
  /// A sample of a writer that was admitted breaks a bound in this field.
  void refuse(Handle writer, const char* field) const;

 private:
  bool judge_sample(Handle writer);
  bool judge(Handle endpoint);

  Participant participant_;
  std::string topic_;
  Kind judges_;
  Handle last_ = 0;                     // writer of the newest sample that was admitted; only the thread that takes samples looks at it
  std::mutex mutex_;                    // guards what follows: matches and samples may come on different threads
  std::set<Handle> trusted_, present_;  // ever; matched now
  std::map<Handle, Refusal> strangers_;
};

}  // namespace consort::wire
