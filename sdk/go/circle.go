// Prints the mean curvatures of a circle of radius 1.
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
	client := connect()
	points := make([][]float64, 8)
	for i := range points {
		y, x := math.Sincos(float64(i) * math.Pi / 4)
		points[i] = []float64{x, y}
	}
	request := gramian.NewCurvaturesRequest(gramian.CloudRef{Points: points})
	answer, _, err := client.GeometryAPI.ComputeCurvatures(context.Background()).CurvaturesRequest(*request).Execute()
	if err != nil {
		log.Fatal(err)
	}
	for _, curvature := range answer.MeanCurvatures {
		fmt.Println(*curvature)
	}
}

func connect() *gramian.APIClient {
	configuration := gramian.NewConfiguration()
	configuration.Servers = gramian.ServerConfigurations{{URL: os.Getenv("GRAMIAN_URL")}}
	return gramian.NewAPIClient(configuration)
}
