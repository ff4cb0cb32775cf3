#include "binary_coding.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace terrane {
namespace {

/// Answers of a seed, and with which chance each is said.
struct Said {
  uint32_t chance;
  bool yes;
};
std::vector<Said> randomAnswers(uint32_t seed, int count) {
  std::mt19937 random(seed);
  std::vector<Said> answers;
  for (int i = 0; i < count; ++i) {
    // Also the least likely answers, and chances beyond what is taken.
    const uint32_t chance = seed % 3 == 0 ? random() % 65536 : (random() % 2) * 65535;
    answers.push_back({chance, random() % 65536 < (random() % 8 == 0 ? 65535 - chance : chance)});
  }
  return answers;
}

std::vector<uint8_t> written(const std::vector<Said>& answers) {
  BinaryWriter writer;
  for (const Said& said : answers) writer.code(said.chance, said.yes);
  std::vector<uint8_t> bytes;
  writer.finish(bytes);
  return bytes;
}

TEST(BinaryCoding, AnswersComeBack) {
  for (uint32_t seed = 0; seed < 300; ++seed) {
    const auto answers = randomAnswers(seed, static_cast<int>(seed) * 7);
    const std::vector<uint8_t> bytes = written(answers);
    size_t used = 0;
    auto reader = BinaryReader::open(bytes, used);
    ASSERT_TRUE(reader.ok()) << seed;
    EXPECT_EQ(used, bytes.size());
    for (size_t i = 0; i < answers.size(); ++i)
      ASSERT_EQ(reader->code(answers[i].chance), answers[i].yes) << seed << ", " << i;
    EXPECT_TRUE(reader->finish()) << seed;
  }
}

TEST(BinaryCoding, CostsWhatAnswersAreWorth) {
  std::mt19937 random(3);
  BinaryWriter writer;
  constexpr int kCount = 100000;
  constexpr uint32_t kChance = 6554;
  for (int i = 0; i < kCount; ++i) writer.code(kChance, random() % 10 == 0);
  std::vector<uint8_t> bytes;
  writer.finish(bytes);
  const double entropy = -0.1 * std::log2(0.1) - 0.9 * std::log2(0.9);
  EXPECT_NEAR(8.0 * static_cast<double>(bytes.size()) / kCount, entropy, 0.01);
}

TEST(BinaryCoding, NothingSaidIsOneByte) {
  EXPECT_EQ(written({}), std::vector<uint8_t>{0});
  // Whatever is likely costs nothing either.
  EXPECT_EQ(written({{60000, false}}).size(), 2U);
  EXPECT_EQ(written({{60000, true}}), std::vector<uint8_t>{0});
}

TEST(BinaryCoding, CutOrLengthenedSegmentsAreRefused) {
  const auto answers = randomAnswers(3, 200);
  const std::vector<uint8_t> bytes = written(answers);
  for (size_t length = 0; length < bytes.size(); ++length) {
    const std::vector<uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    size_t used = 0;
    EXPECT_FALSE(BinaryReader::open(cut, used).ok()) << length;
  }
  // note: the length is one byte here.
  ASSERT_LT(bytes[0], 126);
  for (const uint8_t extra : {uint8_t{0}, uint8_t{7}}) {
    std::vector<uint8_t> longer = bytes;
    longer[0] = static_cast<uint8_t>(longer[0] + 5);
    longer.insert(longer.end(), 5, extra);
    size_t used = 0;
    auto reader = BinaryReader::open(longer, used);
    // Zeros at the end are not written; anything else is left over.
    if (extra == 0) {
      EXPECT_FALSE(reader.ok());
      continue;
    }
    ASSERT_TRUE(reader.ok());
    for (const Said& said : answers) reader->code(said.chance);
    EXPECT_FALSE(reader->finish());
  }
}

TEST(BinaryCoding, LargeNumbersAndPlainBitsComeBack) {
  const std::vector<uint32_t> numbers = {0, 1, 2, 63, 64, 65535, 70000, (1U << 29) - 2};
  BinaryWriter writer;
  for (const uint32_t number : numbers) {
    codeLarge(writer, number);
    codePlain(writer, number, 30);
  }
  std::vector<uint8_t> bytes;
  writer.finish(bytes);
  size_t used = 0;
  auto reader = BinaryReader::open(bytes, used);
  ASSERT_TRUE(reader.ok());
  for (const uint32_t number : numbers) {
    EXPECT_EQ(codeLarge(*reader, 0), number);
    EXPECT_EQ(codePlain(*reader, 0, 30), number);
  }
  EXPECT_TRUE(reader->finish());
}

TEST(BinaryCoding, EvidenceAndChanceAreInverse) {
  const EvidenceTables& tables = evidenceTables();
  for (int evidence = -kMostEvidence; evidence <= kMostEvidence; ++evidence) {
    const auto at = static_cast<size_t>(evidence + kMostEvidence);
    const double exact = 65536.0 / (1.0 + std::exp(-evidence / 256.0));
    EXPECT_NEAR(tables.chance[at].exact, exact, 64.0) << evidence;
    if (evidence > -kMostEvidence) {
      EXPECT_GE(tables.chance[at].exact, tables.chance[at - 1].exact) << evidence;
    }
  }
  for (size_t i = 0; i < tables.evidence.size(); ++i) {
    const auto at = static_cast<size_t>(tables.evidence[i] + kMostEvidence);
    EXPECT_NEAR(tables.chance[at].exact, 16.0 * static_cast<double>(i) + 8.0, 80.0) << i;
  }
}

TEST(BinaryCoding, ModelsLearnAndMixersFollowTheBetterOne) {
  AnswerModel model;
  for (int i = 0; i < 400; ++i) model.learn(i % 4 == 0, 100);
  EXPECT_NEAR(model.chance, 16384, 1500);

  // One model is asked in the context that matters, the other without: the mix is nearly as good as the
  // first.
  std::mt19937 random(5);
  std::array<AnswerModel, 2> knowing;
  AnswerModel blind;
  AnswerMixer<2> mixer{{36000, 36000}};
  BinaryWriter writer;
  constexpr int kCount = 20000;
  for (int i = 0; i < kCount; ++i) {
    const size_t context = random() % 2;
    const bool yes = (random() % 16 == 0) != (context == 1);
    MixedQuestion<2>(evidenceTables(), {&knowing[context], &blind}, mixer).code(writer, 250, yes);
  }
  std::vector<uint8_t> bytes;
  writer.finish(bytes);
  const double entropy = -std::log2(1.0 / 16) / 16 - std::log2(15.0 / 16) * 15 / 16;
  EXPECT_LT(8.0 * static_cast<double>(bytes.size()) / kCount, 1.08 * entropy);
}

}  // namespace
}  // namespace terrane
