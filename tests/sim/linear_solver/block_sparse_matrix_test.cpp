#include "server/sim/linear_solver/block_sparse_matrix.h"
#include "tests/sim/linear_solver/tet_edges.h"

#include <gtest/gtest.h>

#include <random>

namespace crumple::sim::linear_solver {
namespace {

// Two tets that share the face 1 2 3, and node 5 without a tet.
const std::vector<Tet> kTwoTets{{0, 1, 2, 3}, {1, 2, 3, 4}};

// A long strip: tet t has nodes t..t+3.
std::vector<Tet> strip(int count) {
  std::vector<Tet> tets;
  for (int t = 0; t < count; ++t) tets.push_back({t, t + 1, t + 2, t + 3});
  return tets;
}

template <class Scalar>
void fill_random(BlockSparseMatrix<Scalar>& A) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto block = [&] { return Mat3(Mat3::NullaryExpr([&] { return uniform(random); })); };
  for (int k = 0; k < A.block_count(); ++k) A.set_block(k, block());
  for (Mat3& D : A.diagonal()) D = block();
}

TEST(BlockSparseMatrix, PatternHasABlockForEveryPairOfNodesOfATet) {
  const auto A = BlockSparseMatrix<double>::from_edges(6, edges_of(kTwoTets));
  EXPECT_EQ(A.rows(), 6);
  EXPECT_EQ(A.block_count(), 18);  // 9 edges, both ways
  EXPECT_GE(A.find(1, 4), 0);
  EXPECT_EQ(A.columns()[A.find(3, 0)], 0);
  EXPECT_EQ(A.find(0, 4), -1);
  EXPECT_EQ(A.find(5, 4), -1);
}

TEST(BlockSparseMatrix, ProductEqualsThatOfTheMatrixEntryByEntry) {
  auto A = BlockSparseMatrix<double>::from_edges(6, edges_of(kTwoTets));
  fill_random(A);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(18, -1, 2.5);
  Eigen::VectorXd y(18);
  A.multiply(x, y, ThreadPool(1));
  EXPECT_LT((y - A.to_sparse() * x).norm(), 1e-14);
  EXPECT_EQ(A.at(1, 4), Mat3(A.to_sparse().toDense().block<3, 3>(3, 12)));
  EXPECT_EQ(A.at(0, 4), Mat3::Zero());
}

TEST(BlockSparseMatrix, FloatBlocksCostFloatRoundingOnly) {
  auto A64 = BlockSparseMatrix<double>::from_edges(203, edges_of(strip(200)));
  auto A32 = BlockSparseMatrix<float>::from_edges(203, edges_of(strip(200)));
  fill_random(A64);
  fill_random(A32);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(609, -1, 2.5);
  Eigen::VectorXd y64(609), y32(609);
  A64.multiply(x, y64, ThreadPool(1));
  A32.multiply(x, y32, ThreadPool(1));
  EXPECT_GT((y64 - y32).norm(), 0);
  EXPECT_LT((y64 - y32).norm(), 1e-7 * y64.norm());  // half an ulp of float is 6e-8
}

TEST(BlockSparseMatrix, ProductHasTheSameBitsForOneAndTwoThreads) {
  auto A = BlockSparseMatrix<float>::from_edges(3003, edges_of(strip(3000)));
  fill_random(A);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(9009, -1, 2.5);
  Eigen::VectorXd one(9009), two(9009);
  A.multiply(x, one, ThreadPool(1));
  A.multiply(x, two, ThreadPool(2));
  EXPECT_EQ(one, two);
}

TEST(BlockSparseMatrix, MultipliesSegmentsOfALongerVector) {
  auto A = BlockSparseMatrix<double>::from_edges(6, edges_of(kTwoTets));
  fill_random(A);
  const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(30, -1, 2.5);
  Eigen::VectorXd y = Eigen::VectorXd::Constant(30, 9.0);
  A.multiply(x.segment(7, 18), y.segment(7, 18), ThreadPool(1));
  EXPECT_LT((y.segment(7, 18) - A.to_sparse() * x.segment(7, 18)).norm(), 1e-14);
  EXPECT_EQ(y[6], 9.0);
  EXPECT_EQ(y[25], 9.0);
}

}  // namespace
}  // namespace crumple::sim::linear_solver
