/// What a link does, said once: every number goes through values and back, is judged by its bounds, and is told in words.

#include "core/network/link_spec.hpp"

#include "core/errors.hpp"
#include "tests/core/cases.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace consort {
namespace {

LinkSpec everything() {
  LinkSpec link;
  link.loss_probability = 0.25;
  link.delay_rounds = 2;
  link.noise_covariance = Matrix{{2.0, 0.5}, {0.5, 1.0}};
  link.bursts = BurstLoss::example();
  link.jitter = {Jitter::Kind::uniform, 0.0, 3.0};
  link.duplication = 0.375;
  link.reordering = Reordering::example();
  link.quantiser = Quantiser::example();
  link.distance = DistanceLoss::example();
  return link;
}

/// That link once for each of its numbers, changed: what cannot hold the change (a whole number) stays.
std::vector<std::pair<std::string, LinkSpec>> with_one_changed(const std::function<double(double)>& change) {
  std::vector<std::pair<std::string, LinkSpec>> links;
  for (std::size_t changed = 0, count = 1; changed < count; ++changed) {
    LinkSpec link = everything();
    std::string name;
    std::size_t at = 0;
    const auto number = [&](const auto& called, auto& value) {
      using Number = std::remove_reference_t<decltype(value)>;
      if (at++ != changed) return;
      name = called;
      const double wanted = change(static_cast<double>(value));
      if (std::is_same_v<Number, double> || (wanted >= 0.0 && wanted <= 1e9)) value = static_cast<Number>(wanted);
    };
    LinkSpec::fields([&](const LinkKey& key, auto member) {
      auto& value = link.*member;
      using Value = std::remove_reference_t<decltype(value)>;
      if constexpr (std::is_arithmetic_v<Value>)
        number(key.name, value);
      else if constexpr (requires { value->objection(); })
        Value::value_type::fields([&](const LinkKey& part, auto... members) { (number(part.name, (*value).*members), ...); });
    });
    count = at;
    links.emplace_back(name, link);
  }
  return links;
}

TEST(LinkSpec, IsItsValues) {
  const LinkSpec link = everything();
  const Values values = values_of(link);
  EXPECT_EQ(link_of(values), link);
  EXPECT_EQ(values.find("gilbert_elliott")->size(), 4);
  EXPECT_EQ(*values.find("noise_covariance"), link.noise_covariance);
  for (const Values::Entry& left_out : values.entries()) {
    Values others;
    for (const Values::Entry& entry : values.entries())
      if (entry.name != left_out.name) others.set(entry.name, entry.value);
    EXPECT_NE(link_of(others), link) << left_out.name;
  }
  EXPECT_TRUE(values_of(LinkSpec{}).entries().empty());
  EXPECT_EQ(link_of({}), LinkSpec{});
}

TEST(LinkSpec, DiffersInEveryNumber) {
  const auto links = with_one_changed([](double number) { return number + 1.0; });
  EXPECT_EQ(links.size(), 1 + 4 + 2 + 1 + 1 + 2 + 3U);  // all but the jitter's and the covariance's
  for (const auto& [name, link] : links) EXPECT_NE(link, everything()) << name;
}

TEST(LinkSpec, JudgesEveryNumberByItsBounds) {
  EXPECT_FALSE(objection(everything()));
  EXPECT_FALSE(objection(LinkSpec{}));
  for (const double wrong : {std::nan(""), -1e300, 1e8})
    for (const auto& [name, link] : with_one_changed([wrong](double) { return wrong; })) {
      if (link == everything() || (name == "range" && !std::isnan(wrong))) continue;  // not changed; no bounds
      EXPECT_EQ(objection(link).has_value(), wrong != 1e8 || name != "lost") << name << ' ' << wrong;
    }
  LinkSpec link;
  link.bursts = BurstLoss{1.5, 0.5};
  EXPECT_EQ(objection(link), "gilbert_elliott: p_good_to_bad 1.5; allowed: 0 to 1");
  link = {};
  link.distance = DistanceLoss{-1.0, 2.0};
  EXPECT_EQ(objection(link), "distance: safe -1; allowed: from 0 on");
  link.distance = DistanceLoss{2.0, 2.0};
  EXPECT_EQ(objection(link), "loss over the distances [2, 2]; allowed: two distances, ascending");
  link = {};
  link.reordering = Reordering{0.5, 0};
  EXPECT_EQ(objection(link), "reordering: later_rounds 0; allowed: 1 to 65536");
}

TEST(LinkSpec, RefusesValuesOfNoLink) {
  const auto refused = [](std::string_view name, Matrix numbers) {
    Values values = values_of(everything());
    values.set(name, std::move(numbers));
    try {
      static_cast<void>(link_of(values));
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused("duplicaton", Matrix::Ones(1, 1)).find("nearest: duplication"), std::string::npos);
  EXPECT_EQ(refused("gilbert_elliott", Matrix::Ones(3, 1)), "a link's gilbert_elliott of 3 numbers; allowed: 4");
  EXPECT_EQ(refused("duplication", Matrix::Ones(2, 1)), "a link's duplication of 2 numbers; allowed: 1");
  EXPECT_EQ(refused("delay_rounds", Matrix::Constant(1, 1, 1.5)), "a link's delay_rounds 1.5; allowed: whole numbers");
  EXPECT_NE(refused("delay_rounds", Matrix::Constant(1, 1, -1.0)), "");
  EXPECT_NE(refused("delay_rounds", Matrix::Constant(1, 1, 1e300)), "");
  EXPECT_EQ(refused("jitter", Matrix{{4.0}, {0.0}, {0.0}}), "a link's jitter of kind 4; allowed: 0 to 3");
}

TEST(LinkSpec, IsToldInWords) {
  EXPECT_EQ(words_of(LinkSpec{}), "ideal");
  EXPECT_EQ(words_of(LinkSpec{.delay_rounds = 1}), "delay 1 round");
  EXPECT_EQ(words_of(everything()),
            "loss 0.25, loss 0.0818 in bursts of 2.34 messages (Gilbert-Elliott), loss growing from distance 5 to 20, delay 2 to 5 rounds, "
            "duplication 0.375, reordering 0.1 by 2 rounds, noise covariance matrix of 2 x 2, 8 bits over [-10, 10]");
}

TEST(LinkSpec, LosesByAnyCauseOfLoss) {
  EXPECT_FALSE(LinkSpec{}.loses() || LinkSpec{.duplication = 0.5}.loses());
  EXPECT_TRUE(LinkSpec{.loss_probability = 0.1}.loses());
  EXPECT_TRUE(LinkSpec{.bursts = BurstLoss{}}.loses());
  EXPECT_TRUE(LinkSpec{.distance = DistanceLoss{}}.loses());
}

}  // namespace
}  // namespace consort
