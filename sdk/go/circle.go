// Prints the mean curvature of a circle of radius 1.
package main

import (
	"context"
	"fmt"
	"log"
	"math"
	"os"

	"gramian"
)

func main() {
	// begin README
	configuration := gramian.NewConfiguration()
	configuration.Servers = gramian.ServerConfigurations{{URL: os.Getenv("GRAMIAN_URL")}}
	api := gramian.NewAPIClient(configuration).GeometryAPI
	request := gramian.NewCurvaturesRequest(gramian.CloudInput{Points: circle(8)})
	answer, _, err := api.ComputeCurvatures(context.Background()).CurvaturesRequest(*request).Execute()
	if err != nil {
		log.Fatal(err)
	}
	fmt.Println(*answer.MeanCurvatures[0])
	// end README
}

func circle(n int) [][]float64 {
	points := make([][]float64, n)
	for i := range points {
		y, x := math.Sincos(2 * math.Pi * float64(i) / float64(n))
		points[i] = []float64{x, y}
	}
	return points
}
