// SPDX-License-Identifier: MIT
#include "object_reader.hpp"

namespace hal::canopen::config {

namespace {

/// Returns the dummy object that fills a gap of this many bits; none if CiA 301 has no such type.
Type gap_type(std::uint64_t bits) {
    switch (bits) {
    case 1: return Type::boolean;
    case 8: return Type::unsigned8;
    case 16: return Type::unsigned16;
    case 32: return Type::unsigned32;
    default: return Type::none;
    }
}

std::string wrong_direction(const Known& known, bool to_node) {
    if (to_node && known.from_node) return "the node sends it: map it to a tpdo";
    if (!to_node && known.to_node) return "the node receives it: map it to an rpdo";
    return "the device description does not allow it in a PDO";
}

}  // namespace

Object mapped_object(const Known& known, unsigned bits) {
    Object out;
    out.index = known.index;
    out.sub = known.sub;
    out.type = known.type;
    out.bits = static_cast<std::uint8_t>(bits);
    out.pin = known.name;
    out.about = known.about;
    return out;
}

NamedObject ObjectReader::find(const Word& word) const {
    if (const Known* known = catalog_.find(lower(word.text))) return {std::nullopt, known};
    const auto address = parse_address(word, report_);
    return {address, address ? catalog_.find(address->index, address->sub) : nullptr};
}

bool ObjectReader::reject(const Word& word, std::string sentence, std::string help) const {
    report_.error(Topic::object, word.at, std::move(sentence), std::move(help));
    return false;
}

bool ObjectReader::read(const Word& word, bool to_node, Object& out) const {
    const auto words = words_of(word);
    if (words.empty()) {
        return reject(word, "missing object between commas", "write OBJECT, OBJECT");
    }
    if (same_word(words[0].text, "gap")) return read_gap(word, words, to_node, out);
    const NamedObject object = find(words[0]);
    const auto& address = object.address;
    if (address && !address->has_sub && (object.known == nullptr || !object.known->single) &&
        catalog_.has(address->index)) {
        return reject(word, "object " + index_text(address->index) + " has sub-indices",
                      "write " + object_text(address->index, 1));
    }
    const auto type = words.size() == 2 ? parse_type(words[1], report_) : std::nullopt;
    if (words.size() > 2 || (words.size() == 2 && !type)) {
        return reject(
            word, "invalid object '" + word.text + "'",
            std::string("write NAME, or INDEX:SUB TYPE with one of the types ") + value_type_names);
    }
    if (object.known == nullptr) return read_unknown(word, words[0], object, type, to_node, out);
    return read_known(word, *object.known, type, to_node, out);
}

bool ObjectReader::read_gap(const Word& word, const std::vector<Word>& words, bool to_node,
                            Object& out) const {
    const auto bits = words.size() == 2 ? parse_natural(words[1].text) : std::nullopt;
    const Type type = gap_type(bits.value_or(0));
    if (type == Type::none || !to_node) {
        return reject(word, "invalid gap '" + word.text + "'",
                      "an rpdo can have gap 1, gap 8, gap 16 or gap 32");
    }
    out.index = static_cast<std::uint16_t>(type);
    out.bits = static_cast<std::uint8_t>(*bits);
    out.type = type;
    out.filler = true;
    return true;
}

bool ObjectReader::read_unknown(const Word& word, const Word& name, const NamedObject& object,
                                std::optional<Type> type, bool to_node, Object& out) const {
    const auto& address = object.address;
    if (undescribed_ && !(address && type)) return false;
    if (!address && catalog_.empty()) {
        return reject(word, "this node has no device description",
                      "write eds = FILE, or device = " + listed(Catalog::profiles()));
    }
    if (!address) {
        const std::string near = did_you_mean(lower(name.text), catalog_.names(to_node));
        return reject(
            word, "unknown object '" + name.text + "'",
            near.empty() ? "a PDO can carry " + listed(catalog_.names(to_node), 6) : near);
    }
    if (!type) {
        return reject(
            word,
            "the device description has no object " + object_text(address->index, address->sub),
            "state its type: " + name.text + " u16");
    }
    if (bits_of(*type) == 0) {
        return reject(word, "objects of this type have no fixed length",
                      std::string("write ") + value_type_names);
    }
    Known unknown;
    unknown.index = address->index;
    unknown.sub = address->sub;
    unknown.about = lower(address->has_sub ? object_text(address->index, address->sub)
                                           : index_text(address->index));
    unknown.name = dashed(unknown.about);
    unknown.type = *type;
    out = mapped_object(unknown, bits_of(*type));
    return true;
}

bool ObjectReader::read_known(const Word& word, const Known& known, std::optional<Type> type,
                              bool to_node, Object& out) const {
    if (to_node ? !known.to_node : !known.from_node) {
        return reject(
            word,
            "object '" + known.name + "' cannot be mapped to " + (to_node ? "an rpdo" : "a tpdo"),
            wrong_direction(known, to_node));
    }
    const Type as = type.value_or(known.type);
    if (bits_of(as) == 0) {
        return reject(word, "object '" + known.name + "' has no fixed length",
                      "a PDO carries numbers");
    }
    out = mapped_object(known, bits_of(as));
    out.type = as;
    return true;
}

}  // namespace hal::canopen::config
