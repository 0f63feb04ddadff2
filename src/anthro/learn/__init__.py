"""Networks learn here: data sets from shards, one training loop for every DNN, findings."""
