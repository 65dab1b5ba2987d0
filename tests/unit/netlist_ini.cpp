// SPDX-License-Identifier: MIT
#include "tests/unit/netlist_text.hpp"

namespace {

class Ini_file : public netlist_text::Netlist {
protected:
    hal::Ini read(const std::string& text) {
        return hal::Ini::read(sources, folder.write("test.ini", text), found);
    }
    /// Diagnostics without the name of the temporary folder.
    std::string said_of_ini() const {
        std::string text = render(found, sources);
        for (std::size_t at; (at = text.find(folder.path(""))) != text.npos;) {
            text.erase(at, folder.path("").size());
        }
        return text;
    }
    netlist_text::Folder folder;
};

TEST_F(Ini_file, gives_first_and_all_values) {
    const hal::Ini ini =
        read("[HAL]\nHALFILE = a.hal\nHALFILE=b.hal x\n  [ AXIS ]\n[AXIS]\n\tMAX\t= 1.5  \n");
    EXPECT_EQ(render(found, sources), "");
    EXPECT_EQ(ini.get("HAL", "HALFILE"), "a.hal");
    EXPECT_EQ(ini.all("HAL", "HALFILE"), (std::vector<std::string>{"a.hal", "b.hal x"}));
    EXPECT_EQ(ini.get("AXIS", "MAX"), "1.5");
    EXPECT_EQ(ini.get("", "MAX"), "1.5");
    EXPECT_EQ(ini.get("AXIS", "max"), std::nullopt);
    EXPECT_EQ(ini.get("axis", "MAX"), std::nullopt);
    EXPECT_EQ(ini.names(), (std::vector<std::string>{"[HAL]HALFILE", "[HAL]HALFILE", "[AXIS]MAX"}));
    EXPECT_FALSE(ini.empty());
}

TEST_F(Ini_file, has_comments_on_lines_of_their_own_only) {
    const hal::Ini ini = read("# one\n; two\n[S]\n  # three\nA = value # not a comment\nB = 1;2\n");
    EXPECT_EQ(render(found, sources), "");
    EXPECT_EQ(ini.get("S", "A"), "value # not a comment");
    EXPECT_EQ(ini.get("S", "B"), "1;2");
}

TEST_F(Ini_file, keeps_quotes_and_further_equal_signs) {
    const hal::Ini ini = read("[S]\nA = \"b c\"\nB = x=1 y=2\nC =\n");
    EXPECT_EQ(ini.get("S", "A"), "\"b c\"");
    EXPECT_EQ(ini.get("S", "B"), "x=1 y=2");
    EXPECT_EQ(ini.get("S", "C"), "");
}

TEST_F(Ini_file, joins_lines_and_accepts_dos_line_ends) {
    const hal::Ini ini = read("[S]\r\nA = one \\\r\ntwo\r\nB = 3\r\n");
    EXPECT_EQ(ini.get("S", "A"), "one two");
    EXPECT_EQ(ini.get("S", "B"), "3");
}

TEST_F(Ini_file, includes_others_relative_to_itself) {
    folder.write("more.inc", "B = 2\n[T]\nC = 3\n");
    const hal::Ini ini = read("[S]\nA = 1\n#INCLUDE more.inc\nD = 4\n");
    EXPECT_EQ(render(found, sources), "");
    EXPECT_EQ(ini.get("S", "B"), "2");
    EXPECT_EQ(ini.get("T", "C"), "3");
    EXPECT_EQ(ini.get("T", "D"), "4");
}

TEST_F(Ini_file, stops_when_it_includes_itself) {
    read("#INCLUDE test.ini\n#INCLUDE test.ini\n");
    EXPECT_GT(found.errors(), 0u);
    EXPECT_EQ(found.all()[0].message,
              "INI files include each other more than 16 deep or 1000 times");
}

TEST_F(Ini_file, warns_of_lines_that_are_nothing) {
    read("[S]\nnothing\n[T\n= 3\n");
    EXPECT_EQ(
        said_of_ini(),
        R"(test.ini:2:1: warning: invalid line, ignored: neither [SECTION] nor KEY = value [bad-ini-line]
    2 | nothing
      | ^^^^^^^

test.ini:3:1: warning: section name without ']' [bad-ini-line]
    3 | [T
      | ^^

test.ini:4:1: warning: invalid line, ignored: neither [SECTION] nor KEY = value [bad-ini-line]
    4 | = 3
      | ^^^
)");
}

TEST_F(Ini_file, that_is_no_text_is_one_error) {
    read(std::string("[S]\nA\0=1\n\0\n", 11));
    EXPECT_EQ(said_of_ini(), R"(test.ini:2:2: error: this is not a text file [binary-text]
    2 | A\x00=1
      |  ^^^^ a control character
      = help: an INI file is plain text in UTF-8
)");
}

TEST_F(Ini_file, that_is_missing_is_an_error) {
    EXPECT_TRUE(hal::Ini::read(sources, folder.path("none.ini"), found).empty());
    EXPECT_EQ(said_of_ini(),
              "error: cannot read 'none.ini': No such file or directory [unreadable-file]\n");
}

TEST_F(Ini_file, gives_values_to_netlists) {
    const hal::Ini ini =
        read("[AXIS_X]\nMAX = 2.5\nLIST = a b\n[HM]\nBOARD = 7i76e\nBOARD = other\n");
    found.clear();
    environment.ini = &ini;
    EXPECT_EQ(
        words("setp x.max [AXIS_X]MAX\nsetp hm2_[HM](BOARD).0.x [AXIS_X]LIST\nsetp y \"[]MAX\""),
        "<setp> <x.max> <2.5>\n<setp> <hm2_7i76e.0.x> <a> <b>\n<setp> <y> <\"2.5\">\n");
}

TEST_F(Ini_file, suggests_keys_for_one_that_is_not_there) {
    const hal::Ini ini = read("[AXIS_X]\nMAX_VELOCITY = 2.5\nMAX_LIMIT = 1\n");
    environment.ini = &ini;
    EXPECT_EQ(
        said("setp a [AXIS_X]MAX_VELOCTY\nsetp b [NONE]NOTHING\n"),
        R"(test.hal:1:8: error: unknown key '[AXIS_X]MAX_VELOCTY': not in the INI file [unset-ini-key]
    1 | setp a [AXIS_X]MAX_VELOCTY
      |        ^^^^^^^^^^^^^^^^^^^ did you mean '[AXIS_X]MAX_VELOCITY'?
      = help: keys of [AXIS_X]: MAX_VELOCITY, MAX_LIMIT

test.hal:2:8: error: unknown key '[NONE]NOTHING': not in the INI file [unset-ini-key]
    2 | setp b [NONE]NOTHING
      |        ^^^^^^^^^^^^^
)");
}

TEST_F(Ini_file, that_was_not_given_is_named_as_the_reason) {
    EXPECT_EQ(
        said("setp a [AXIS_X]MAX\n"),
        R"(test.hal:1:8: error: '[AXIS_X]MAX' has no value: no INI file was given, or it has no keys [unset-ini-key]
    1 | setp a [AXIS_X]MAX
      |        ^^^^^^^^^^^
      = help: specify it with --ini FILE.ini (halcmd: -i FILE.ini)
)");
}

TEST_F(Ini_file, serves_many_keys_and_many_questions) {
    std::string text = "[S]\n", netlist;
    for (int i = 0; i < 50'000; ++i) {
        text += "K" + std::to_string(i) + " = " + std::to_string(i) + "\n";
        netlist += "setp p [S]K" + std::to_string(i) + "\n";
    }
    const hal::Ini ini = read(text);
    environment.ini = &ini;
    const auto commands = parse(netlist);
    ASSERT_EQ(commands.size(), 50'000u);
    EXPECT_EQ(commands[49'999].args[1].text, "49999");
}

TEST_F(Ini_file, read_source_says_why_a_file_cannot_be_read) {
    const auto asked = add("source missing.hal\n");
    EXPECT_EQ(hal::read_source(sources, "missing/none.hal", {asked, 7, 18}, found), std::nullopt);
    EXPECT_EQ(hal::read_source(sources, "/", {asked, 7, 18}, found), std::nullopt);
    EXPECT_EQ(
        render(found, sources),
        R"(test.hal:1:8: error: cannot read 'missing/none.hal': No such file or directory [unreadable-file]
    1 | source missing.hal
      |        ^^^^^^^^^^^

test.hal:1:8: error: cannot read '/': it is a directory [unreadable-file]
    1 | source missing.hal
      |        ^^^^^^^^^^^
)");
}

}  // namespace
