#include "orchestrator/cli/link_schema.hpp"

#include "core/network/link_spec.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <type_traits>

namespace consort {
namespace {

using Json = nlohmann::ordered_json;

Json reference(std::string_view name) { return {{"$ref", fmt::format("#/definitions/{}", name)}}; }

// Whole numbers without a point.
Json number(double value) {
  const auto whole = static_cast<std::int64_t>(std::abs(value) < 1e15 ? value : 0.5);
  return static_cast<double>(whole) == value ? Json(whole) : Json(value);
}

Json described(const LinkKey& key, const std::string& standard) {
  const std::string meaning(key.meaning);
  return {{"title", key.title}, {"description", standard.empty() ? meaning : meaning + " Default: " + standard + "."}};
}

Json bounds(const LinkKey& key, const char* type) {
  Json out{{"type", type}};
  if (key.least > -kNoBound) out["minimum"] = number(key.least);
  if (key.most < kNoBound) out["maximum"] = number(key.most);
  return out;
}

// Some numbers of `effect`: one, or a list.
template <class Effect, class First, class... Others>
Json value_of(const Effect& effect, First first, Others... others) {
  if constexpr (sizeof...(others) == 0)
    return number(effect.*first);
  else
    return Json::array({number(effect.*first), number(effect.*others)...});
}

template <class Effect>
Json mapping_of(const LinkKey&, std::optional<Effect> LinkSpec::*) {
  Json required = Json::array(), properties;
  Effect::fields([&](const LinkKey& key, auto... member) {
    const Json standard = value_of(Effect{}, member...);
    Json property = described(key, key.required ? "" : standard.dump());
    constexpr bool kWhole = (std::is_same_v<decltype(member), std::uint32_t Effect::*> && ...);
    const Json one = bounds(key, kWhole ? "integer" : "number");
    if constexpr (sizeof...(member) == 1)
      property.update(one);
    else
      property.update({{"type", "array"}, {"minItems", sizeof...(member)}, {"maxItems", sizeof...(member)}, {"items", one}});
    if (key.required)
      required.push_back(key.name);
    else
      property["default"] = standard;
    property["examples"] = Json::array({value_of(Effect::example(), member...)});
    properties[std::string(key.name)] = property;
  });
  return {{"type", "object"}, {"additionalProperties", false}, {"required", required}, {"properties", properties}};
}

template <class Effect>
Json definition_of(const LinkKey& key, std::optional<Effect> LinkSpec::*effect) {
  Json out = described(key, key.of_loss ? "" : "none"), example;
  if (key.of_loss)
    out.update(mapping_of(key, effect));
  else
    out.update({{"oneOf", {{{"enum", {"none"}}}, mapping_of(key, effect)}}, {"default", "none"}});
  Effect::fields([&](const LinkKey& part, auto... member) { example[std::string(part.name)] = value_of(Effect::example(), member...); });
  out["examples"] = Json::array({example});
  return out;
}

Json definition_of(const LinkKey& key, double LinkSpec::*) {
  Json out = described(key, "0");
  out.update(bounds(key, "number"));
  out.update({{"default", 0}, {"examples", {key.example}}});
  return out;
}

Json object(const char* title, const char* description, const Json& properties) {
  return {{"title", title}, {"description", description}, {"type", "object"}, {"additionalProperties", false}, {"properties", properties}};
}

}  // namespace

nlohmann::ordered_json link_definitions() {
  Json definitions, causes, keys{{"loss", reference("loss")}};
  LinkSpec::fields([&](const LinkKey& key, auto member) {
    const std::string name(key.name);
    if constexpr (std::is_same_v<decltype(member), Jitter LinkSpec::*>) return;
    if constexpr (requires { definition_of(key, member); }) definitions[name] = definition_of(key, member);
    if constexpr (std::is_same_v<decltype(member), Round LinkSpec::*>) keys["delay"] = reference("delay");
    (key.of_loss ? causes : keys)[name] = reference(name);
  });
  const Json several{{"type", "object"}, {"additionalProperties", false}, {"minProperties", 1}, {"properties", causes}};
  definitions["loss"] = {
      {"title", "Loss"},
      {"description",
       "Of each message: a probability from 0 to 1, or a mapping with one cause or several, independent of each other; a "
       "message arrives if it survives each. Default: 0."},
      {"oneOf", {{{"type", "number"}, {"minimum", 0}, {"maximum", 1}}, several}},
      {"examples", {0.1, {{"bernoulli", 0.1}}, {{"gilbert_elliott", definitions["gilbert_elliott"]["examples"][0]}}}}};
  Json of_all = keys, of_some{{"edge", reference("edge")}, {"edges", reference("edge_list")}};
  const Json exception{{"edge", "3 -> 7"}, {"delay_rounds", 2}};
  of_all["overrides"] = {
      {"title", "Exceptions by edge"},
      {"description", "Each entry names one edge (edge) or several (edges); what it does not mention stays as for all links."},
      {"type", "array"},
      {"items", reference("link_override")},
      {"examples", Json::array({Json::array({exception})})}};
  of_some.update(keys);
  definitions["links"] = object("Links", "What every link does to its messages, and exceptions by edge.", of_all);
  definitions["links"]["examples"] = Json::array({{{"loss", {{"bernoulli", 0.1}}}, {"noise_covariance", 0.1}}});
  definitions["link_override"] = object("Exception", "An edge or several, and what is different there.", of_some);
  definitions["link_override"]["examples"] = Json::array({exception});
  return definitions;
}

}  // namespace consort
