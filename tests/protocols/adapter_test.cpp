#include "protocols/adapter.hpp"
#include "core/errors.hpp"
#include "protocols/registry.hpp"
#include "tests/support/sanitized.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <functional>

// Counts heap allocations, Eigen's and the library's, by standing in front of malloc; sanitizers bring their own.
#ifndef CONSORT_SANITIZED
#define CONSORT_COUNTS_ALLOCATIONS
namespace {
std::atomic<std::size_t> allocations = 0;
}
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
#endif

namespace consort {
namespace {

Values initial_of(const Vector& x, const Matrix& P) {
  Values initial;
  initial.set("x", x);
  initial.set("P", P);
  return initial;
}

std::unique_ptr<Protocol> make(std::string_view name, const Values& parameters, const Values& initial, AgentId self = AgentId{1}) {
  return find_protocol(name).make(parameters, Setup{self, 10, 1.0, initial});
}

std::string config_error(const std::function<void()>& action) {
  try {
    action();
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no ConfigError";
}

std::string run_error(const std::function<void()>& action) {
  try {
    action();
  } catch (const RunError& error) {
    return error.what();
  }
  return "no RunError";
}

TEST(Registry, DescribesEveryProtocolAndFindsItByItsName) {
  for (const ProtocolEntry& entry : protocol_table()) {
    EXPECT_FALSE(entry.summary.empty() || entry.source.empty() || entry.assumptions.empty()) << entry.name;
    if (!entry.needs_plant) {  // else the state is the plant's
      EXPECT_EQ(entry.initial[0].name, "x") << entry.name;
    }
    EXPECT_EQ(&find_protocol(entry.name), &entry);
  }
  EXPECT_GE(protocol_table().size(), 8U);
}

TEST(Registry, NamesTheNearestProtocol) {
  const std::string text = config_error([] { (void)find_protocol("kalman_concensus"); });
  EXPECT_NE(text.find("'kalman_concensus'"), std::string::npos) << text;
  EXPECT_NE(text.find("nearest: kalman_consensus"), std::string::npos) << text;
}

TEST(Adapter, RefusesAnUnknownParameterAndNamesTheNearest) {
  Values parameters;
  parameters.set("omega", 0.1);
  const std::string text = config_error([&] { make("kalman_consensus", parameters, initial_of(Vector::Ones(1), Matrix::Ones(1, 1))); });
  EXPECT_NE(text.find("kalman_consensus"), std::string::npos) << text;
  EXPECT_NE(text.find("nearest: Omega"), std::string::npos) << text;
}

TEST(Adapter, RefusesAMissingInitialState) {
  const std::string text = config_error([] { make("local_voting", {}, {}, AgentId{4}); });
  EXPECT_NE(text.find("agent 4"), std::string::npos) << text;
}

TEST(Adapter, RefusesASelfTermThatIsNeitherZeroNorOne) {
  Values parameters;
  parameters.set("self_term", 0.5);
  EXPECT_THROW(make("kalman_consensus", parameters, initial_of(Vector::Ones(1), Matrix::Ones(1, 1))), ConfigError);
}

TEST(Adapter, RefusesAnExactInitialEstimate) {
  for (const char* name :
       {"kalman_consensus", "continuous_kalman_consensus", "unbiased_kalman_consensus", "unbiased_information_consensus"})
    EXPECT_THROW(make(name, {}, initial_of(Vector::Ones(1), Matrix::Zero(1, 1))), ConfigError) << name;
}

TEST(Adapter, LaysFieldsOutColumnMajorAndNoiseOnTheState) {
  Matrix P(2, 2);
  P << 2.0, 0.5, 0.5, 3.0;
  const auto protocol = make("unbiased_kalman_consensus", {}, initial_of(Vector::LinSpaced(2, 7.0, 8.0), P));
  const Layout expected{{{"x", 2, 1}, {"P", 2, 2}, {"out_degree", 1, 1}, {"exponents", 2, 1}}, 0, 2};
  EXPECT_EQ(protocol->message_layout(), expected);
  EXPECT_EQ(protocol->estimate_layout(), (Layout{{{"x", 2, 1}}, 0, 0}));
  std::vector<double> payload(9);
  protocol->emit(Sense{0, 1.0, {}, 3, {}}, payload);
  EXPECT_EQ(payload, (std::vector<double>{7.0, 8.0, 2.0, 0.5, 0.5, 3.0, 3.0, 0.0, 0.0}));
}

TEST(Adapter, DimensionsInsideAndOutsideTheTableAgree) {
  // Two independent components: the two-dimensional instantiation must do what two scalar ones do; so must five (sized at run time).
  for (const Eigen::Index n : {2, 3, 4, 5, 6, 8, 11}) {
    SCOPED_TRACE(n);
    Values parameters;
    parameters.set("Q", 0.1);
    parameters.set("Omega", 0.2);
    for (const char* name : {"kalman_consensus", "unbiased_kalman_consensus"}) {
      const Vector x = Vector::LinSpaced(n, 1.0, 2.0), other = Vector::LinSpaced(n, -3.0, 4.0);
      const Vector P = Vector::LinSpaced(n, 0.5, 1.5);
      const auto vector = make(name, parameters, initial_of(x, Matrix(P.asDiagonal())));
      const auto sender = make(name, parameters, initial_of(other, Matrix(P.reverse().asDiagonal())), AgentId{2});
      std::vector<double> payload(vector->message_layout().size()), estimate(static_cast<std::size_t>(n));
      sender->emit(Sense{0, 1.0, {}, 2, {}}, payload);
      vector->absorb(Sense{}, std::array{Received{AgentId{2}, 0, 1.0, payload}});
      vector->estimate(estimate);
      for (Eigen::Index c = 0; c < n; ++c) {
        const auto scalar = make(name, parameters, initial_of(x.segment(c, 1), P.segment(c, 1)));
        const auto scalar_sender = make(name, parameters, initial_of(other.segment(c, 1), P.reverse().segment(c, 1)), AgentId{2});
        std::vector<double> scalar_payload(scalar->message_layout().size()), expected(1);
        scalar_sender->emit(Sense{0, 1.0, {}, 2, {}}, scalar_payload);
        scalar->absorb(Sense{}, std::array{Received{AgentId{2}, 0, 1.0, scalar_payload}});
        scalar->estimate(expected);
        EXPECT_NEAR(estimate[static_cast<std::size_t>(c)], expected[0], 1e-14);
      }
    }
  }
}

#ifdef CONSORT_COUNTS_ALLOCATIONS
TEST(Adapter, FixedSizesNeverAllocateInSteadyState) {
  for (const ProtocolEntry& entry : protocol_table()) {
    if (entry.needs_plant) continue;  // their sizes follow from the plant and are known at run time only
    for (const Eigen::Index n : {1, 2, 3, 4, 6, 8}) {
      SCOPED_TRACE(std::string(entry.name) + " " + std::to_string(n));
      const Values initial = initial_of(Vector::Ones(n), Matrix::Identity(n, n));
      const std::size_t at_first = allocations;
      const auto protocol = entry.make({}, consort::Setup{AgentId{1}, 10, 0.1, initial});
      ASSERT_GT(allocations, at_first) << "the count works: making a protocol allocates";
      std::vector<double> payload(protocol->message_layout().size()), estimate(static_cast<std::size_t>(n));
      const Sense sense{0, 0.1, {}, 4, {}};
      protocol->emit(sense, payload);
      std::vector<Received> inbox(4, Received{AgentId{2}, 0, 1.0, payload});
      protocol->absorb(sense, inbox);
      const std::size_t before = allocations;
      for (int round = 0; round < 20; ++round) {
        protocol->emit(sense, payload);
        protocol->absorb(sense, inbox);
        protocol->estimate(estimate);
      }
      EXPECT_EQ(allocations - before, 0u);
    }
  }
}

TEST(Adapter, RunTimeSizesNeverAllocatePerMessage) {
  for (const ProtocolEntry& entry : protocol_table()) {
    if (entry.needs_plant) continue;
    SCOPED_TRACE(entry.name);
    const Values initial = initial_of(Vector::Ones(10), Matrix::Identity(10, 10));
    const auto allocations_of_absorb = [&](std::size_t messages) {
      const auto protocol = entry.make({}, consort::Setup{AgentId{1}, 100, 0.01, initial});
      std::vector<double> payload(protocol->message_layout().size());
      const Sense sense{0, 0.01, {}, 4, {}};
      protocol->emit(sense, payload);
      const std::vector<Received> inbox(messages, Received{AgentId{2}, 0, 1.0, payload});
      protocol->absorb(sense, inbox);
      const std::size_t before = allocations;
      protocol->absorb(sense, inbox);
      return allocations - before;
    };
    EXPECT_EQ(allocations_of_absorb(50), allocations_of_absorb(2));
  }
}
#endif  // CONSORT_COUNTS_ALLOCATIONS

TEST(Adapter, NamesAgentRoundAndProtocolWhenTheEstimateOverflows) {
  const Values initial = initial_of(Vector::Constant(1, 1e308), Matrix::Ones(1, 1));
  const auto protocol = make("local_voting", {}, initial, AgentId{3});
  const std::array payload{-1e308};
  const std::string text = run_error([&] {
    protocol->absorb(Sense{17, 10.0, {}, 0, {}}, std::array{Received{AgentId{2}, 17, 1.0, payload}});
  });
  for (const char* word : {"local_voting", "agent 3", "round 17"}) EXPECT_NE(text.find(word), std::string::npos) << text;
}

TEST(Adapter, NamesMatrixSizeAndConditionWhenACovarianceIsSingular) {
  for (const Eigen::Index n : {2, 5}) {
    const Values initial = initial_of(Vector::Ones(n), Matrix::Identity(n, n));
    const auto protocol = make("kalman_consensus", {}, initial, AgentId{3});
    std::vector<double> payload(protocol->message_layout().size(), 1.0);  // x = 1, P = all ones: rank one
    Sense sense{17, 1.0, {}, 0, {}};
    sense.self = AgentId{3};
    const std::string text = run_error([&] { protocol->absorb(sense, std::array{Received{AgentId{2}, 17, 1.0, payload}}); });
    for (const std::string& word : {std::string("kalman_consensus"), std::string("agent 3"), std::string("round 17"),
                                    std::string("P_j + Omega"), std::to_string(n) + " x " + std::to_string(n), std::string("condition")})
      EXPECT_NE(text.find(word), std::string::npos) << text;
  }
}

TEST(SpdInverse, IsTheInverseExactlySymmetricWhateverTheUnits) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    SCOPED_TRACE(seed);
    Stream stream = Seed{seed}.stream(Purpose("spd"));
    const Eigen::Index n = 2 + static_cast<Eigen::Index>(stream.below(7));
    const Matrix a = Matrix::NullaryExpr(n, n, [&] { return stream.uniform(-1.0, 1.0); });
    const Vector units = Vector::NullaryExpr(n, [&] { return std::pow(10.0, stream.uniform(-9.0, 9.0)); });
    const Matrix well = a * a.transpose() + 0.1 * Matrix::Identity(n, n);
    Matrix spd = units.asDiagonal() * well * units.asDiagonal();  // condition up to 1e36, none of it real
    spd.triangularView<Eigen::StrictlyUpper>() = spd.transpose();
    SpdInverse<Eigen::Dynamic> inverse(n, {"test", AgentId{1}, 0});
    const Matrix result = inverse(spd, "a");
    EXPECT_EQ(result, result.transpose());
    const Matrix scaled = units.asDiagonal() * result * units.asDiagonal();
    EXPECT_LT((scaled * well - Matrix::Identity(n, n)).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(SpdInverse, RefusesIndefiniteInfiniteAndVanishingMatrices) {
  SpdInverse<2> inverse(2, {"test", AgentId{1}, 0});
  Eigen::Matrix2d indefinite, infinite, nearly;
  indefinite << 1.0, 2.0, 2.0, 1.0;
  infinite << std::numeric_limits<double>::infinity(), 0.0, 0.0, 1.0;
  nearly << 1.0, 1.0 - 1e-16, 1.0 - 1e-16, 1.0;
  EXPECT_THROW(inverse(indefinite, "a"), RunError);
  EXPECT_THROW(inverse(infinite, "a"), RunError);
  EXPECT_THROW(inverse(nearly, "a"), RunError);
  SpdInverse<1> scalar(1, {"test", AgentId{1}, 0});
  for (const double value : {0.0, -1.0, 1e-310, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
    EXPECT_THROW(scalar(Eigen::Matrix<double, 1, 1>(value), "a"), RunError) << value;
}

}  // namespace
}  // namespace consort
