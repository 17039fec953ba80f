#include "tests/http/schema_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "api/openapi.h"

namespace fstop::test {
namespace {

using nlohmann::json;

const json& document() {
  static const json parsed = json::parse(api::openapi_json());
  return parsed;
}

const json& resolved(const json& schema) {
  if (!schema.contains("$ref")) return schema;
  return resolved(
      document().at(json::json_pointer(schema.at("$ref").get<std::string>().substr(1))));
}

// The schemas of which a value takes one: `schema` itself where it leaves no choice.
std::vector<const json*> alternatives(const json& schema) {
  for (const char* word : {"oneOf", "anyOf"}) {
    // Camera's oneOf only says which members it must have.
    if (!schema.contains(word) || schema.contains("properties")) continue;
    std::vector<const json*> all;
    for (const json& each : schema.at(word)) {
      const auto more = alternatives(resolved(each));
      all.insert(all.end(), more.begin(), more.end());
    }
    return all;
  }
  return {&schema};
}

std::set<std::string> types_of(const json& schema) {
  std::set<std::string> types;
  for (const json* each : alternatives(schema)) {
    const json& type = each->at("type");
    if (type.is_array()) {
      types.insert(type.begin(), type.end());
    } else {
      types.insert(type.get<std::string>());
    }
  }
  return types;
}

class Generator {
 public:
  explicit Generator(Dice& dice) : dice_(dice) {}

  json value(const json& reference, const std::string& pointer, bool is_required) {
    const json& schema = resolved(reference);
    const std::vector<const json*> choices = alternatives(schema);
    const json& chosen = *choices[dice_.below(choices.size())];
    sites_.push_back({pointer, &schema, &chosen, is_required});
    if (chosen.contains("enum")) return chosen.at("enum")[dice_.below(chosen.at("enum").size())];
    std::string type = chosen.at("type").is_array() ? "" : chosen.at("type").get<std::string>();
    if (type.empty()) {
      type = chosen.at("type")[0].get<std::string>();
      if (dice_.one_in(3)) return nullptr;
    }
    if (type == "null") return nullptr;
    if (type == "object") return object(chosen, pointer);
    if (type == "array") return array(chosen, pointer);
    if (type == "string") return text(chosen, pointer);
    if (type == "boolean") return dice_.one_in(2);
    const double drawn = number(chosen);
    if (type == "integer") return static_cast<std::int64_t>(std::floor(drawn));
    return drawn;
  }

  std::vector<Site> take_sites() { return std::move(sites_); }

 private:
  json object(const json& schema, const std::string& pointer) {
    json made = json::object();
    std::set<std::string> required;
    if (schema.contains("required"))
      required.insert(schema.at("required").begin(), schema.at("required").end());
    std::set<std::string> left_out;
    if (schema.contains("oneOf")) {  // of members of which exactly one may be there
      const json& choices = schema.at("oneOf");
      const std::size_t taken = dice_.below(choices.size());
      for (std::size_t i = 0; i < choices.size(); ++i)
        (i == taken ? required : left_out).insert(choices[i].at("required")[0].get<std::string>());
    }
    if (schema.contains("anyOf")) {  // of members of which at least one must be there
      const json& choices = schema.at("anyOf");
      const std::size_t taken = dice_.below(choices.size());
      required.insert(choices[taken].at("required")[0].get<std::string>());
    }
    if (schema.contains("properties")) {
      for (const auto& [name, member] : schema.at("properties").items()) {
        const bool must = required.contains(name);
        if (left_out.contains(name) || (!must && !dice_.one_in(3))) continue;
        made[name] = value(member, pointer + "/" + name,
                           must && !schema.contains("oneOf") && !schema.contains("anyOf"));
      }
    } else {
      for (const char* name : kNames) {
        if (dice_.one_in(2))
          made[name] = value(schema.at("additionalProperties"), pointer + "/" + name, false);
      }
    }
    return made;
  }

  json array(const json& schema, const std::string& pointer) {
    const std::size_t least = schema.value("minItems", std::size_t{0});
    const std::size_t most = std::min(schema.value("maxItems", std::size_t{3}), least + 3);
    const std::size_t size = least + dice_.below(most - least + 1);
    const bool is_set = schema.value("uniqueItems", false);
    json made = json::array();
    for (std::size_t i = 0; i < size; ++i) {
      json item = value(schema.at("items"), pointer + "/" + std::to_string(made.size()), false);
      const bool is_there = std::find(made.begin(), made.end(), item) != made.end();
      if (is_set && is_there) {
        sites_.pop_back();
      } else {
        made.push_back(std::move(item));
      }
    }
    return made;
  }

  std::string text(const json& schema, const std::string& pointer) {
    if (schema.contains("pattern")) return dice_.one_in(4) ? "no-such-scene" : "tiny";
    const std::string_view name = std::string_view(pointer).substr(pointer.rfind('/') + 1);
    if (name == "material" || name == "texture") return kNames[dice_.below(kNames.size())];
    const std::size_t most = schema.value("maxLength", std::size_t{20});
    if (dice_.one_in(8)) return std::string(most, 'x');
    constexpr std::array<const char*, 6> kWords = {
        "", "a", "../a.png", "tiny/a.ply", "\u00e9\u4e16", "\"\\\n"};
    return kWords[dice_.below(kWords.size())];
  }

  double number(const json& schema) {
    const double min = schema.value("minimum", -1e6);
    const double max = schema.value("maximum", 1e6);
    if (dice_.one_in(8)) return min;
    if (dice_.one_in(8)) return max;
    if (min > 0.0) return std::clamp(min * std::pow(max / min, dice_.unit()), min, max);
    // Most quantities of use are far from the ends.
    const double near = std::pow(10.0, 6.0 * dice_.unit() - 3.0) * (dice_.one_in(2) ? 1.0 : -1.0);
    return std::clamp(near, min, max);
  }

  static constexpr std::array<const char*, 3> kNames = {"a", "b", "c/~ %"};
  Dice& dice_;
  std::vector<Site> sites_ = {};
};

json::json_pointer pointer_of(const std::string& text) {
  // The one name with marks that pointers escape.
  std::string escaped = text;
  const std::size_t at = escaped.find("c/~ %");
  if (at != std::string::npos) escaped.replace(at, 5, "c~1~0 %");
  return json::json_pointer(escaped);
}

// What a problem document calls the place: RFC 6901 section 6.
std::string fragment_of(std::string pointer) {
  const std::size_t at = pointer.find("c/~ %");
  if (at != std::string::npos) pointer.replace(at, 5, "c~1~0%20%25");
  return "#" + pointer;
}

class Vandal {
 public:
  Vandal(const SchemaValue& valid, Dice& dice) : valid_(valid), dice_(dice) {}

  Violation violation() {
    for (;;) {
      const Site& site = valid_.sites[dice_.below(valid_.sites.size())];
      Violation made{.value = valid_.value, .pointer = fragment_of(site.pointer)};
      json& place = made.value.at(pointer_of(site.pointer));
      if (spoil(site, place, made)) return made;
    }
  }

 private:
  bool spoil(const Site& site, json& place, Violation& made) {
    switch (dice_.below(5)) {
      case 0:
        return set_wrong_type(site, place, made);
      case 1:
        return leave_range(site, place, made);
      case 2:
        return add_member(site, place, made);
      case 3:
        return remove(site, made);
      default:
        return resize(site, place, made);
    }
  }

  bool set_wrong_type(const Site& site, json& place, Violation& made) {
    const std::set<std::string> types = types_of(*site.schema);
    const std::vector<std::pair<const char*, json>> others = {{"boolean", true},
                                                              {"number", 0.5},
                                                              {"string", "zz"},
                                                              {"array", json::array({json()})},
                                                              {"object", {{"zz", 1}}}};
    const auto& [type, value] = others[dice_.below(others.size())];
    if (types.contains(type)) return false;
    if (type == std::string("number") && types.contains("integer")) {
      made.what = "half of a whole number";
    } else {
      made.what = std::string(type) + " instead";
    }
    place = value;
    return true;
  }

  bool leave_range(const Site& site, json& place, Violation& made) {
    const json& schema = *site.chosen;
    made.what = "out of range";
    if (schema.contains("enum")) {
      // Where a word is an alternative to numbers, any other is of the wrong type.
      place = "zz";
      return true;
    }
    const bool may_be_less = site.schema->contains("anyOf");  // blades: 0 or 3 and more
    if (schema.contains("maximum") && (may_be_less || dice_.one_in(2))) {
      place = 2.0 * std::abs(schema.at("maximum").get<double>()) + 1.0;
      return true;
    }
    if (!schema.contains("minimum")) return false;
    place = -2.0 * std::abs(schema.at("minimum").get<double>()) - 1.0;
    return true;
  }

  bool add_member(const Site& site, json& place, Violation& made) {
    if (site.chosen->value("additionalProperties", json(true)) != json(false)) return false;
    place["zz"] = 1;
    made.pointer += "/zz";
    made.what = "unknown member";
    return true;
  }

  bool remove(const Site& site, Violation& made) {
    if (!site.is_required) return false;
    const auto pointer = pointer_of(site.pointer);
    made.value.at(pointer.parent_pointer()).erase(pointer.back());
    made.what = "missing member";
    return true;
  }

  bool resize(const Site& site, json& place, Violation& made) {
    if (!place.is_array() || !site.chosen->contains("maxItems")) return false;
    const std::size_t most = site.chosen->at("maxItems").get<std::size_t>();
    if (most > 300 || place.empty()) return false;
    while (place.size() <= most) place.push_back(place[0]);
    made.what = "too many items";
    return true;
  }

  const SchemaValue& valid_;
  Dice& dice_;
};

}  // namespace

SchemaValue value_of_schema(const std::string& name, Dice& dice) {
  Generator generator(dice);
  SchemaValue made;
  made.value = generator.value({{"$ref", "#/components/schemas/" + name}}, "", false);
  made.sites = generator.take_sites();
  return made;
}

Violation violation_of(const SchemaValue& valid, Dice& dice) {
  return Vandal(valid, dice).violation();
}

}  // namespace fstop::test
