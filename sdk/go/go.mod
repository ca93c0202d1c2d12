module gramian.example

go 1.19

require gramian v0.0.0

replace gramian => ../../target/sdk/go
