// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_nrrd.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <string>

#include "tests/core/mesh/expect_error.h"
#include "tests/core/volume_files/volume_bytes.h"
#include "tests/support/temporary_folder.h"

namespace ccslice {
namespace {

using testing::ElementsAre;

const std::string kNrrdHead = "NRRD0004\n# a comment\ntype: short\ndimension: 3\nsizes: 3 2 1\nendian: little\n";

VolumeFile nrrd_of(const std::string& text) { return read_nrrd(text, ""); }

TEST(ReadNrrd, ReadsEachEncoding) {
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: raw\n\n" + six_samples()));
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: gzip\n\n" + gzipped(six_samples())));
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: gz\nkey:=value: of its own\n\n" + gzipped(six_samples())));
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: ascii\n\n1 2 3\n-4 5 600\n"));
  expect_six_samples(nrrd_of("NRRD0001\ntype: SHORT\r\ndimension: 3\nsizes: 3 2 1\nencoding: txt\n\n1 2 3 -4 5 600"));
  expect_six_samples(nrrd_of("NRRD0004\ntype: int16\ndimension: 3\nsizes: 3 2 1\nendian: big\nencoding: raw\n\n" +
                             raw<std::int16_t>({1, 2, 3, -4, 5, 600}, true)));
}

TEST(ReadNrrd, SkipsWhatIsBefore) {
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: raw\nline skip: 2\nbyte skip: 3\n\nx\ny\n123" + six_samples()));
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: raw\nbyte skip: -1\n\nwhatever" + six_samples()));
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: gzip\nbyteskip: 4\n\n" + gzipped("1234" + six_samples())));
  expect_six_samples(nrrd_of(kNrrdHead + "encoding: gzip\nbyteskip: -1\n\n" + gzipped("12345" + six_samples())));
}

TEST(ReadNrrd, ReadsAFileOfItsOwn) {
  const TemporaryFolder folder;
  std::ofstream(folder.path() / "a.raw") << six_samples();
  const std::string header = kNrrdHead + "encoding: raw\ndata file: a.raw\n";
  expect_six_samples(read_nrrd(header, (folder.path() / "a.nhdr").string()));
  expect_error(
      [&] { (void)read_nrrd(kNrrdHead + "encoding: raw\ndata file: /etc/passwd\n", (folder.path() / "a").string()); },
      ErrorCode::kFileUnsupported, "/etc/passwd");
  expect_error([&] { (void)nrrd_of(kNrrdHead + "encoding: raw\ndata file: LIST\na\nb\n"); },
               ErrorCode::kFileUnsupported, "several files");
  expect_error([&] { (void)nrrd_of(kNrrdHead + "encoding: raw\ndata file: a%03d.raw 1 9 1\n"); },
               ErrorCode::kFileUnsupported, "several files");
}

TEST(ReadNrrd, TurnsSpacesToLps) {
  const auto place = [](const std::string& space) {
    return nrrd_of(kNrrdHead + "encoding: raw\n" + space +
                   "space directions: (0.5,0,0) (0,0,2) (0,3,0)\nspace origin: (10,20,30)\n\n" + six_samples());
  };
  const VolumeFile lps = place("space: left-posterior-superior\n");
  EXPECT_TRUE(lps.is_lps);
  EXPECT_TRUE((*lps.mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(10.5, 23, 32)));
  EXPECT_TRUE((*place("space: RAS\n").mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(-10.5, -23, 32)));
  EXPECT_TRUE(
      (*place("space: left-anterior-superior-time\n").mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(10.5, -23, 32)));
  const VolumeFile scanner = place("space: scanner-xyz\n");
  EXPECT_FALSE(scanner.is_lps);
  EXPECT_TRUE((*scanner.mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(10.5, 23, 32)));
}

TEST(ReadNrrd, KnowsSpacesInShortAndUnits) {
  const auto place = [](const std::string& fields) {
    return nrrd_of(kNrrdHead + "encoding: raw\n" + fields + "space directions: (1,0,0) (0,1,0) (0,0,1)\n\n" +
                   six_samples());
  };
  EXPECT_TRUE((*place("space: RAST\n").mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(-1, -1, 1)));
  EXPECT_TRUE(place("space: LPST\n").is_lps);
  const VolumeFile um = place("space units: \"um\" \"um\" \"um\"\n");
  EXPECT_TRUE((*um.mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(0.001, 0.001, 0.001)));
  EXPECT_TRUE(um.notes.empty());
  EXPECT_THAT(place("space units: \"ell\" \"ell\" \"ell\"\n").notes, ElementsAre(testing::HasSubstr("ell")));
}

TEST(ReadNrrd, LooksAtKindsOfThreeAxes) {
  const VolumeFile file = nrrd_of(
      "NRRD0004\ntype: uchar\ndimension: 3\nencoding: raw\nsizes: 3 2 1\n"
      "kinds: RGB-color domain domain\n\nabcdef");
  EXPECT_EQ(file.shape.channels, 3u);
  EXPECT_EQ(file.shape.samples, (std::array<std::uint32_t, 3>{2, 1, 1}));
}

TEST(ReadNrrd, TakesSpacingsAlone) {
  const VolumeFile file = nrrd_of(kNrrdHead + "encoding: raw\nspacings: 0.5 2 3\n\n" + six_samples());
  EXPECT_FALSE(file.is_lps);
  EXPECT_TRUE((*file.mm_of_index * Vec3(1, 1, 1)).isApprox(Vec3(0.5, 2, 3)));
  EXPECT_FALSE(nrrd_of(kNrrdHead + "encoding: raw\n\n" + six_samples()).mm_of_index.has_value());
}

TEST(ReadNrrd, FindsChannelsOnTheFirstAxisOrTheLast) {
  const std::string head = "NRRD0005\ntype: uchar\ndimension: 4\nencoding: raw\n";
  const VolumeFile first =
      nrrd_of(head + "sizes: 2 1 3 1\nkinds: vector domain domain domain\n\n" + raw<std::uint8_t>({1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(first.shape.channels, 2u);
  EXPECT_EQ(first.shape.samples, (std::array<std::uint32_t, 3>{1, 3, 1}));
  EXPECT_THAT(numbers_of(first), ElementsAre(1, 2, 3, 4, 5, 6));
  const VolumeFile last = nrrd_of(head + "sizes: 1 3 1 2\nspace directions: (1,0,0) (0,1,0) (0,0,1) none\n\n" +
                                  raw<std::uint8_t>({1, 3, 5, 2, 4, 6}));
  EXPECT_EQ(last.shape.channels, 2u);
  EXPECT_THAT(numbers_of(last), ElementsAre(1, 2, 3, 4, 5, 6));
  ASSERT_TRUE(last.mm_of_index.has_value());
  for (const std::string text :
       {"sizes: 1 2 3 1\nkinds: domain vector domain domain\n\n123456", "sizes: 1 2 3 1\n\n123456"}) {
    expect_error([&] { (void)nrrd_of(head + text); }, ErrorCode::kFileUnsupported, "");
  }
}

TEST(ReadNrrd, SaysWhatIsWrong) {
  const auto refuses = [](const std::string& text, ErrorCode code, const std::string& part) {
    expect_error([&] { (void)nrrd_of(text); }, code, part);
  };
  const ErrorCode syntax = ErrorCode::kFileSyntax, unsupported = ErrorCode::kFileUnsupported;
  refuses("what else", syntax, "not a NRRD file");
  refuses("NRRD0004\ntype: short\ndimension: 3\nsizes: 3 2 1\nencoding: raw\n\n" + six_samples(), syntax,
          "field endian");
  refuses("NRRD0004\ndimension: 3\nsizes: 3 2 1\nencoding: raw\n\n", syntax, "field type");
  refuses("NRRD0004\ntype: block\n", syntax, "line 2: type: 'block'");
  refuses("NRRD0004\nnothing\n", syntax, "line 2: expected FIELD: VALUE");
  refuses(kNrrdHead + "encoding: bzip2\n\n", unsupported, "bzip2");
  refuses(kNrrdHead + "encoding: raw\n\n" + six_samples().substr(1), syntax,
          "11 bytes of samples, and the header promises 12");
  refuses(kNrrdHead + "encoding: raw\nline skip: 9\n\n" + six_samples(), syntax, "fewer lines");
  refuses(kNrrdHead + "encoding: raw\nspace directions: (1,0,0) 5\n\n", syntax, "expected a vector");
  refuses(kNrrdHead + "encoding: raw\nspace directions: (1,0,0) (0,1,0)\n\n", syntax, "as many as there are axes");
  refuses(kNrrdHead + "encoding: raw\nspace directions: (1,0) (0,1) (1,1)\n\n", syntax, "fewer than 3 numbers");
  refuses(kNrrdHead + "encoding: raw\nspace directions: none none none\n\n", unsupported, "3 axes, of which 0");
  refuses("NRRD0004\ntype: uchar\ndimension: 2\nsizes: 3 2 1\nencoding: raw\n\n", syntax, "sizes");
  refuses("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4000000000 4000000000 4000000000\nencoding: raw\n\n",
          ErrorCode::kVolumeInvalid, "too many");
  refuses("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1024 1024 1048576\nencoding: gzip\n\n", ErrorCode::kMeshTooLarge,
          "8 GiB");
  refuses("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 0 2 1\nencoding: raw\n\n", ErrorCode::kVolumeInvalid,
          "samples_i");
  refuses(kNrrdHead + "encoding: ascii\n\n1 2 3", syntax, "a sample");
}

}  // namespace
}  // namespace ccslice
